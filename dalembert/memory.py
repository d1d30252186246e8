"""Limits of the memory that a result may take."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

MEMORY = 900e6  # bytes that a result may take: what takes more is refused before it is begun


def memory() -> float:
    """Bytes that a result may take: four fifths of what the machine has free, or of what the process is allowed."""
    free = [float("inf")]
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        free.append(next(float(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable")))
    with suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        used = float((group / "memory.current").read_text())
        free.append(float((group / "memory.max").read_text()) - used)
    # Windows has no such limits
    with suppress(ImportError):
        import resource

        allowed = resource.getrlimit(resource.RLIMIT_AS)[0]
        if allowed != resource.RLIM_INFINITY:
            free.append(float(allowed) - 0.5e9)
    least = max(0.0, min(free))
    return 0.8 * least if least < float("inf") else MEMORY
