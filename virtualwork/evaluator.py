"""A few named quantities of one mechanism, requested many times: for loops, optimisers, controllers.

The requested quantities are recorded and prepared once; a call with numbers is then little more than its arithmetic, and
one with arrays is one pass of the engine for all quantities together.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dalembert.hints import nearest
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import DescriptionError
from virtualwork.formulas.forces import Effort, Reaction, Shaking, ShakingMoment
from virtualwork.formulas.kinematics import Angle, Point, Slide
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import xy
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.tapes import Ready, ready, recorded, taped
from virtualwork.plan.steps import joints
from virtualwork.quantities import named

POINT = ("position", "velocity", "acceleration", "jerk")
LINK = ("angle", "omega", "alpha", "jerk")
SLIDE = ("position", "speed", "acceleration", "jerk")


class Evaluator:
    """Named quantities of an assembly over its inputs; `Mechanism.evaluator` makes one.

    Examples
    --------
    >>> from virtualwork import Input, Link, Mechanism
    >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 2})}, inputs=Input(link="arm"))
    >>> at = arm.evaluator("points.P", "links.arm.omega")
    >>> at(0.0, speed=3.0)
    {'points.P': (2.0, 0.0), 'links.arm.omega': 3.0}
    >>> at([0.0, np.pi], speed=3.0)["links.arm.omega"]
    array([3., 3.])
    >>> arm.evaluator("P.x", "arm.omega")(0.0, speed=3.0)
    {'P.x': 2.0, 'arm.omega': 3.0}
    """

    def __init__(self, assembly: Assembly, *wanted: str) -> None:
        self.assembly = assembly
        of = [each for name in wanted for each in requests(assembly, name)]
        self.wanted, self.keys = tuple(name for name, _, _ in of), tuple(key for _, key, _ in of)
        # of vectors of which one component is requested
        self._components = {name: int(imaginary) for name, _, imaginary in of if imaginary is not None}
        # what is requested under two names is in two arrays
        self._once = len(set(self.keys)) == len(self.keys)
        self._ready: dict[tuple[bool, ...], Ready | None] = {}
        inputs, own = assembly.mechanism.inputs, ("speed", "acceleration", "jerk")
        # of one input as floats; of several the poses look them up
        self._own = [getattr(inputs[0], rate) or 0.0 for rate in own] if len(inputs) == 1 else [None] * 3

    def __repr__(self) -> str:
        return f"Evaluator({self.assembly.mechanism.name!r}: {', '.join(self.wanted)})"

    def __call__(
        self,
        angle: ArrayLike,
        speed: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        jerk: ArrayLike | None = None,
    ) -> dict[str, Any]:
        """The quantities, by the names they were requested with.

        Parameters
        ----------
        angle : float, or array (n,); (n, k) for k inputs
            The input: rad for a turning input, m for a slide.
        speed, acceleration, jerk : scalar or of the same shape
            Its derivatives in time; default: the description's own, as in `Mechanism.motion`.

        Returns
        -------
        dict of name to float or (x, y); to array (n,) or (n, 2)
            NaN where the pose cannot be assembled.
        """
        if speed is None:
            speed = self._own[0]
        if acceleration is None:
            acceleration = self._own[1]
        if jerk is None:
            jerk = self._own[2]
        rates = isinstance(speed, float) and isinstance(acceleration, float) and isinstance(jerk, float)
        if rates and isinstance(angle, float) and isfinite(angle):
            moves = speed != 0.0, acceleration != 0.0, jerk != 0.0
            if moves not in self._ready:
                self._ready[moves] = ready(self.assembly, moves, self.keys)
            function = self._ready[moves]
            if function is not None:
                try:
                    values = function(angle, speed, acceleration, jerk)
                except (ZeroDivisionError, ValueError, OverflowError):
                    pass
                else:
                    return self._shown(
                        {
                            name: (value.real, value.imag) if isinstance(value, complex) else value
                            for name, value in zip(self.wanted, values, strict=True)
                        }
                    )
        poses = Lanes(self.assembly, angle, speed, acceleration, jerk, once=self._once)
        numbers = poses.values(self.keys)
        shown = {
            name: xy(value) if key.is_vector else value
            for name, key, value in zip(self.wanted, self.keys, numbers, strict=True)
        }
        if np.ndim(angle):
            return self._shown(shown)
        return self._shown(
            {name: tuple(map(float, np.ravel(v))) if v.ndim > 1 else float(v[0]) for name, v in shown.items()}
        )

    def _shown(self, values: dict[str, Any]) -> dict[str, Any]:
        """The values, of some vectors one component alone."""
        for name, i in self._components.items():
            value = values[name]
            values[name] = value[i] if isinstance(value, tuple) else value[..., i]
        return values

    def operations(self, *, speed: bool = True, acceleration: bool = True) -> int:
        """The number of operations of a pose, without those that no request needs or that a zero rate removes."""
        return taped(self.assembly, recorded(self.assembly, (speed, acceleration, False)), self.keys).cost


def requests(assembly: Assembly, name: str) -> list[tuple[str, Quantity, bool | None]]:
    """The quantities of a name, each with its own name, its key, and of a vector whether it is the y; else None."""
    key = key_of(assembly, name)
    if key is not None:
        return [(name, key, None)]
    of = named(assembly.mechanism, name)
    for each in of:
        if not each.key or each.less or each.polar:
            raise DescriptionError(f"'{name}': an evaluator has no '{each.names[0]}'")
    return [
        (each.names[0] if len(of) > 1 else name, each.key, each.imaginary if each.key.is_vector else None)
        for each in of
    ]


def key_of(assembly: Assembly, name: str) -> Quantity | None:
    """The key of a quantity called as in the JSON output: `points.H.velocity`, `reactions.B.coupler`; else None.

    Raises
    ------
    DescriptionError
        A part of the name is unknown.
    """
    m = assembly.mechanism
    kind, *of = name.split(".")

    def known(word: str, words: Mapping[str, Any] | tuple[str, ...], what: str) -> str:
        if word not in words:
            raise DescriptionError(f"'{name}': no {what} is named '{word}'{nearest(word, words)}")
        return word

    def order(words: tuple[str, ...]) -> int:
        return words.index(known(of[1], words, "derivative")) if len(of) > 1 else 0

    if kind == "points" and of:
        # on the body on which a motion takes it too: an estimate is of that motion's own digits
        body, _ = m.points[known(of[0], m.points, "point")]
        return Point(body, 0j, of[0], order(POINT))
    if kind == "links" and of:
        return Angle(known(of[0], m.links, "link"), order(LINK))
    if kind == "slides" and of:
        return Slide(m.guided[known(of[0], m.guided, "slot or slider")], order(SLIDE))
    if kind == "effort":
        inputs = {entry.name: j for j, entry in enumerate(m.inputs)}
        return Effort(inputs[known(of[0], inputs, "input")] if of else 0)
    if kind == "reactions" and len(of) == 2:
        there = {joint.name: joint for joint in joints(m) if of[1] in joint.bodies}
        return Reaction(known(of[0], there, f"joint of {of[1]}"), of[1])
    if name == "shaking.force":
        return Shaking()
    if name == "shaking.moment":
        return ShakingMoment()
    return None
