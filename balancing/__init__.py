"""Balancing of rotors: from known eccentric masses and from measured vibration.

An unbalance is a complex number m·r·e^{iθ} (kg·m, rad); corrections are what to ADD.
"""

from balancing.correction import CoincidentPlanes, Correction, Unbalances, correct
from balancing.rotor import by_size
from balancing.tolerance import GRADES, allocate, grade_value, permissible_unbalance

__all__ = [
    "GRADES",
    "CoincidentPlanes",
    "Correction",
    "Unbalances",
    "allocate",
    "by_size",
    "correct",
    "grade_value",
    "permissible_unbalance",
]
