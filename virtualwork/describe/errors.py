"""What a description of a mechanism can do wrong."""

from __future__ import annotations


class MechanismError(ValueError):
    """A description that cannot be solved: says which table and key, what was found and what was expected."""


class DescriptionError(MechanismError):
    """The description itself is wrong: an unknown name, a contradiction, a zero length."""


class MobilityError(MechanismError):
    """The parts do not make a mechanism: a free degree of freedom, a structure, an idle input."""


class AssemblyError(MechanismError):
    """No assembly, or none that the guess would choose: names the choices."""


class ParallelGuidesError(AssemblyError):
    """The two guides of a group are parallel: its position is not determined."""
