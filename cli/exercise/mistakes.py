"""The slips of every question of a variant: of the terms of its sum, where it is one, and of the data, by running the command again."""

from __future__ import annotations

from functools import partial

from cli.exercise import motion_slips, rotor_slips, work_slips
from cli.exercise.recomputed import Recomputed
from cli.exercise.slips import Candidates, joined
from cli.exercise.variants import Variant

PROVIDERS = {"work": work_slips.slips, "forces": work_slips.slips, "balance": rotor_slips.slips}


def candidates(variant: Variant, again: Recomputed | None = None) -> list[Candidates]:
    """Return the slips of every question of a variant; `again`: its runs with slips in the data."""
    runs = again or Recomputed(variant)
    return [_of_question(variant, k, runs) for k in range(len(variant.answers))]


def _of_question(variant: Variant, k: int, runs: Recomputed) -> Candidates:
    provider = PROVIDERS.get(variant.problem.exercise.command[0])
    own = None if provider is None else provider(variant, k)
    if own is not None:
        return own
    singles, pairs = motion_slips.slips(variant, k)
    return Candidates(variant.answers[k], [*singles, *runs.slips(k)], joined([pairs, partial(runs.pairs, k)]))
