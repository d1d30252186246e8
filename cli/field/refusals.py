"""Why corrections cannot be found, as sentences."""

from __future__ import annotations

from balancing import DependentTrials
from cli.field.runs import Complex, Group
from cli.read.units import degrees


def _combination(names: list[str], combination: Complex) -> str:
    terms = []
    for name, share in zip(names, combination, strict=True):
        if abs(share) > 1e-6:
            terms.append(f"{abs(share):.3g} at {float(degrees(share)):.0f}° in {name}")
    return ", ".join(terms)


def planes_say(planes: list[str], combination: Complex) -> str:
    """Say which planes the readings cannot tell apart."""
    told = [name for name, share in zip(planes, combination, strict=True) if abs(share) > 1e-6]
    if len(told) == 1:
        return (
            f"plane {told[0]} has no effect on any reading: its correction cannot be found; expected sensors that "
            "respond to it, or the plane left out"
        )
    return (
        f"the readings cannot tell the planes {' and '.join(told)} apart (singular): masses in the ratio "
        f"{_combination(planes, combination)} leave no trace; leave one of these planes out, or damp with --ridge"
    )


def trials_say(group: Group, error: DependentTrials) -> str:
    """Say which planes the trial runs do not tell apart."""
    told = [name for name, share in zip(group.planes, error.combination, strict=True) if abs(share) > 1e-6]
    runs = len(group.trials)
    if runs < len(group.planes):
        return (
            f"{len(group.planes)} planes ({', '.join(group.planes)}) and {runs} trial run{'s' * (runs != 1)}: expected a "
            "trial run for every plane"
        )
    return (
        f"the trial runs do not tell the planes {' and '.join(told)} apart: expected each plane tried by itself, "
        "or in different proportions"
    )
