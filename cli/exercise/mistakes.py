"""The slips of every question of a variant: of the terms of its sum, where it is one, and of the data, by running the command again."""

from __future__ import annotations

from functools import partial

from cli.exercise import load_slips, motion_slips, rotor_slips, work_slips
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
    answer = variant.answers[k]
    parts, pairs = motion_slips.slips(variant, k)
    of_loads, two_loads = (
        load_slips.slips(answer, k, runs.loads) if load_slips.is_sum(answer) else ([], lambda: None)
    )
    return Candidates(
        answer, [*parts, *of_loads, *runs.slips(k)], joined([pairs, two_loads, partial(runs.pairs, k)])
    )
