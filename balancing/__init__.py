"""Balancing of rotors: from known eccentric masses and from measured vibration."""
