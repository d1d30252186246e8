"""What every command on a mechanism shares: its file, its cases, its quantities."""
