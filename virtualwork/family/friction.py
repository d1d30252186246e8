"""The friction of variants on one tape: of every variant in every pose a lane."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dalembert.arithmetic.engines import Outputs, run_grid
from dalembert.arithmetic.tape import Tape
from virtualwork.family.varied_formulas import VariedFormulas
from virtualwork.formulas.forces import Bearing
from virtualwork.formulas.friction import read, settled, written
from virtualwork.formulas.numbers import Complexes, Reals


def friction_of(formulas: VariedFormulas, entering: Callable[[str], Any], shape: tuple[int, int]) -> Reals:
    """The friction of each contact, (c, v, n); NaN where the joints lock.

    Parameters
    ----------
    formulas : VariedFormulas
        Those of the variants, with statics that is not redundant.
    entering : function
        Of an input's name to what broadcasts to (v, n).
    shape : (v, n)
    """
    recording, lanes = formulas.recording, shape[0] * shape[1]
    c = len(recording.forces.case.contacts)
    with recording.lock:
        tape = recording.rubbing = recording.rubbing or written(recording)
        keys = [Bearing(k) for k in range(c)]
        loaded = formulas.tape(keys)

    def run(tape: Tape, frictions: Reals) -> Outputs:
        enter = {f"friction {k}": of.reshape(shape) for k, of in enumerate(frictions)}
        inputs = {name: enter[name] if name in enter else entering(name) for name in tape.inputs}
        return Outputs(tape, np.reshape(run_grid(tape, inputs, shape), (-1, lanes)))

    def bears(frictions: Reals) -> Complexes:
        rows = run(loaded, frictions)
        return np.reshape([key.of_rows(rows, lanes) for key in keys], (c, lanes))

    rows = run(tape, np.empty((0, lanes)))
    friction, _ = settled(*read(rows, c, lanes, bears), bears)
    return friction.reshape(c, *shape)
