"""The slips of every question of a variant: of its terms, where the command has a sum of them, else by running it again."""

from __future__ import annotations

from collections.abc import Iterator

from cli.exercise import rotor_slips, work_slips
from cli.exercise.recomputed import Recomputed
from cli.exercise.slips import Candidates
from cli.exercise.variants import Variant

PROVIDERS = {"work": work_slips.slips, "forces": work_slips.slips, "balance": rotor_slips.slips}


def candidates(variant: Variant) -> list[Candidates]:
    """Return the slips of every question of a variant."""
    return list(_each(variant))


def _each(variant: Variant) -> Iterator[Candidates]:
    provider = PROVIDERS.get(variant.problem.exercise.command[0])
    again = Recomputed(variant)
    for k, answer in enumerate(variant.answers):
        result = None if provider is None else provider(variant, k)
        yield Candidates(answer, again.slips(k)) if result is None else result
