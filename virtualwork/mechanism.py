"""A mechanism as its designer describes it, with everything that it can compute: the entrance of the package."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING
from warnings import warn

import numpy as np
from numpy.typing import ArrayLike

from virtualwork.branch.assembly import Assembly
from virtualwork.describe import MechanismError
from virtualwork.describe.numbered import Numbered
from virtualwork.describe.reader import read, read_text
from virtualwork.describe.values import as_number
from virtualwork.motion import Motion

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from dalembert.page import Page
    from virtualwork.evaluator import Evaluator
    from virtualwork.family.design import Design
    from virtualwork.family.fitted import Fit
    from virtualwork.family.keep import Bound
    from virtualwork.family.target import Target
    from virtualwork.intime.run import Run
    from virtualwork.intime.variants import Variants
    from virtualwork.study.check import Check
    from virtualwork.study.equilibrium import Equilibria
    from virtualwork.study.newton_table import AllAtOnce


class Mechanism(Numbered):
    """A planar mechanism: its links and joints, its inputs and its loads.

    Parameters
    ----------
    ground : mapping of name to (x, y)
        The fixed points, m.
    links : mapping of name to Link
        Points that share a name are pinned together.
    guides : sequence of Guide
        Slots and sliders.
    gears : sequence of Gear
    inputs : Input or sequence of Input
    guess : Guess
        Rough link angles or point positions that choose the assembly.

    Raises
    ------
    DescriptionError
        Where names are unknown or sizes contradict each other; the message names the place.

    Examples
    --------
    Norton's four-bar (Design of Machinery, ex. 4-1): crank 40, coupler 120, rocker 80, ground 100 mm.

    >>> import math
    >>> from virtualwork import Guess, Input, Link
    >>> m = Mechanism(
    ...     ground={"A": (0, 0), "D": (0.100, 0)},
    ...     links={"crank": Link({"A": (0, 0), "B": (0.040, 0)}),
    ...            "coupler": Link({"B": (0, 0), "C": (0.120, 0)}),
    ...            "rocker": Link({"D": (0, 0), "C": (0.080, 0)})},
    ...     inputs=Input(link="crank"),
    ...     guess=Guess(at=(math.radians(40),), angles={"coupler": 0.3, "rocker": 1.0}))
    >>> round(math.degrees(m.motion(math.radians(40)).link("rocker").angle[0]), 2)
    57.32
    """

    @classmethod
    def from_toml(cls, path: str | Path, load: Callable[[Path], bytes] = Path.read_bytes) -> Mechanism:
        """Read the TOML description of a mechanism.

        Parameters
        ----------
        path : str or Path
        load : callable, optional
            Reads it and the tables beside it.

        Raises
        ------
        DescriptionError
            Names the file, the table and the key, what was found and what was expected.
        """
        return read(Path(path), cls, load)

    @classmethod
    def from_toml_text(
        cls,
        text: str,
        file: str = "<text>",
        folder: Path | None = None,
        load: Callable[[Path], bytes] = Path.read_bytes,
    ) -> Mechanism:
        """Read the TOML text of a description; `file` names it in messages, `folder` is where its tables lie."""
        return read_text(text, cls, file, folder, load)

    def to_toml(self, length: str = "m", angle: str = "rad") -> str:
        """Return the TOML text of this description; `from_toml_text` reads the same mechanism from it.

        Parameters
        ----------
        length, angle : str
            The units of bare lengths and angles.

        Raises
        ------
        DescriptionError
            A part has no text: rows without the name of a table, an end of a spring at a point without a name.

        Examples
        --------
        >>> from virtualwork import Input, Link
        >>> m = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 2})}, inputs=Input(link="arm"))
        >>> longer = m.changed({"links.arm.P.x": 2.5})
        >>> "[links.arm]\\npoints = { O = [0, 0], P = [2.5, 0] }" in longer.to_toml()
        True
        """
        from virtualwork.describe.text import toml_text

        return toml_text(self, length, angle)

    @cached_property
    def assembly(self) -> Assembly:
        """The assembly that the guess chooses, ready to move; a doubtful guess is warned of (UserWarning), once."""
        result = Assembly.from_guess(self)
        for text in result.warnings:
            # of the caller of `motion` and of all else that moves
            warn(text, UserWarning, stacklevel=4)
        return result

    def _repr_html_(self) -> str | None:
        """Draw the mechanism in the pose of its file; None, which shows its `repr`, if it cannot be assembled."""
        from virtualwork.notebook_picture import svg

        try:
            motion = self.motion()
            return svg(motion.poses, motion.drawing)
        except MechanismError:
            return None

    def motion(
        self,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        jerk: ArrayLike | None = None,
    ) -> Motion:
        """Return the motion of the assembly that the guess chooses; every quantity is solved on the first request.

        Parameters
        ----------
        angle : array (n,), or (n, k) for k inputs
            The input: rad for a turning input, m for a slide.
        speed, acceleration, jerk : same shape or scalar
            Its derivatives in time.

        Each of them that is not given is the description's own.

        Examples
        --------
        >>> from virtualwork import Input, Link
        >>> m = Mechanism(ground={"O": (0, 0)}, links={"arm": Link({"O": (0, 0), "P": (2, 0)})},
        ...               inputs=Input(link="arm"))
        >>> m.motion(0.0, speed=3.0).point("P").velocity
        array([[0., 6.]])
        """
        return Motion(self.assembly, angle, speed, acceleration, jerk)

    def page(self, over: ArrayLike | None = None, forces: bool = False) -> Page:
        """Return the page that computes (`Motion.page`) over inputs (n,) or (n, k), rad or m; default: a turn from the file's pose."""
        start = self.motion().inputs
        turn = np.linspace(0.0, 0.0 if len(self.inputs) > 1 or self.inputs[0].is_slide else 2 * np.pi, 361)
        return self.motion(start + turn[:, None] if over is None else over).page(forces)

    def simulate(
        self,
        times: ArrayLike,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        accuracy: float = 1e-9,
        until: Mapping[str, float] | None = None,
    ) -> Run:
        """Simulate the motion under gravity, forces, torques, springs, dampers and friction.

        Virtual work with d'Alembert's forces is the equation of motion of the inputs; see `virtualwork.intime`.

        Parameters
        ----------
        times : array (n,)
            Rising, s; the motion starts at the first.
        angle, speed : float or array (k,), optional
            The inputs at the first time, rad or m, and their speeds. Default: the description's own.
        accuracy : float
            The wanted error of the inputs at every time, relative to one radian or the mechanism's size.
        until : mapping of input name to its value, optional
            The motion ends where an input reaches its value; the last time is that of the event.

        Returns
        -------
        Run

        Raises
        ------
        MechanismError
            Where the motion is not determined: no mass moves with an input, the start cannot be assembled.
        ValueError
            Times that do not rise, an accuracy that is none, an unknown input.

        Examples
        --------
        A pendulum released at rest from the side, after 1 s:

        >>> from virtualwork import Input, Link
        >>> pendulum = Mechanism({"O": 0j}, {"bob": Link({"O": 0j}, mass=1, center=1)}, inputs=Input(link="bob"),
        ...                      gravity=-9.81j)
        >>> pendulum.simulate([0, 1], angle=0.0).angle[-1].round(6)
        array([-2.975824])
        """
        from virtualwork.intime.run import simulate

        return simulate(self.assembly, times, angle, speed, accuracy, until)

    def evaluator(self, *wanted: str) -> Evaluator:
        """Return an evaluator of named quantities of the assembly that the guess chooses, for many requests.

        Parameters
        ----------
        wanted : str
            Names as `--only` has them (`H.x`, `coupler.omega`, `crank.torque`, `B.coupler.fx`; `H` is all of H), or as in the
            JSON output: `points.H`, `points.H.velocity`, `links.coupler.omega`, `slides.S.speed`, `effort`,
            `reactions.B.coupler` (the force of all others on that link), `shaking.force`, `shaking.moment`.

        Raises
        ------
        DescriptionError
            Where a name is not known.

        Examples
        --------
        >>> from virtualwork import Input, Link
        >>> m = Mechanism({"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"),
        ...               gravity=-9.81j)
        >>> m.evaluator("effort")(0.0)
        {'effort': 9.81}
        """
        from virtualwork.evaluator import Evaluator

        return Evaluator(self.assembly, *wanted)

    def vary(self, numbers: Mapping[str, ArrayLike]) -> Variants:
        """Return a family of variants of this mechanism, with other numbers at the paths of some dimensions.

        Parameters
        ----------
        numbers : mapping of path to array (v,)
            SI; a point's own path takes (v, 2). The paths are those of `describe.dimensions`.

        Raises
        ------
        DescriptionError
            Where a path names no number of the description.
        ValueError
            Where the arrays differ in length, or a number is not finite.

        Examples
        --------
        >>> from virtualwork import Input, Link
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1}, mass=2, center=1)}, inputs=Input("arm"),
        ...                 gravity=-10j)
        >>> arm.vary({"links.arm.mass": [1.0, 2.0, 4.0]}).motion(0.0).effort[:, 0]
        array([10., 20., 40.])
        """
        from virtualwork.intime.variants import Variants

        return Variants(self, numbers)

    def fit(
        self,
        wanted: str | Sequence[Target],
        target: ArrayLike | None = None,
        free: Mapping[str, tuple[float, float]] | None = None,
        inputs: ArrayLike | None = None,
        starts: int = 256,
        seed: int = 0,
        best: int = 1,
        executor: Executor | None = None,
        keep: Sequence[Bound] = (),
    ) -> Fit[Mechanism]:
        """Find the dimensions with which points, links, slides or the effort come nearest to targets, by least squares.

        Parameters
        ----------
        wanted : str, or sequence of Target
            `H` or `points.H`: a point along a path; `H.y`: one of its coordinates, `links.rocker`: a link's angle,
            `slides.B`: a slide's travel, over the input (function generation); `effort.crank`: the input's torque or
            force. Targets hold their own places, inputs and weights.
        target : array (n, 2), or complex (n,); array (n,)
            Of the one name: places in m; coordinates and travels in m, angles in rad, efforts in N·m or N. Two rows or
            more.
        free : mapping of path to (low, high)
            The dimensions that are looked for, and their bounds, SI.
        inputs : array (n,), optional
            The input at each row, rad or m; without it that is free, in the order of the rows.
        starts : int
            Points of a Sobol sequence within the bounds; the description's own numbers are the first start.
        seed : int
            Of that sequence.
        best : int
            So many distinct solutions, as far as there are: the further ones are `others` of the best.
        executor : concurrent.futures.Executor
            Refines the starts; the numbers are the same without it.
        keep : sequence of Bound
            What stays above or below a bound from the first to the last input of the target (a whole turn where the
            input is free): the transmission angle, a coordinate, an angle, a travel, the effort.

        Raises
        ------
        DescriptionError
            Unknown names, a dimension that moves no point, bounds the wrong way round.
        MechanismError
            Where no start within the bounds can be assembled at every row, or none keeps what is to be kept.
        ValueError
            A target of fewer than two rows, or not as many inputs.

        Examples
        --------
        >>> from virtualwork import Input, Link
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1})}, inputs=Input("arm"))
        >>> found = arm.fit("P", [(2, 0), (0, 2)], {"links.arm.P.x": (0.5, 3)}, inputs=[0, 1.5707963267948966])
        >>> round(found.parameters["links.arm.P.x"], 9), found.max < 1e-9
        (2.0, True)
        """
        from virtualwork.family.fitting import fit
        from virtualwork.family.target import Target

        if isinstance(wanted, str):
            wanted = [Target({wanted: () if target is None else target}, inputs)]
        elif target is not None or inputs is not None:
            raise ValueError("fit: expected targets, or one name with its target and inputs")
        free = {} if free is None else free
        if not isinstance(free, Mapping) or any(np.shape(bounds) != (2,) for bounds in free.values()):
            example = "{'links.crank.B.x': (0.01, 0.1)}"
            raise ValueError(
                f"free: found {free!r}, expected a low and a high bound by path, such as {example}"
            )
        return fit(self, wanted, free, starts, seed, best, executor, keep)

    def design(self, paths: Sequence[str], *wanted: str) -> Design:
        """Return positions as a function of some dimensions, with exact derivatives, for an optimiser of your own.

        Parameters
        ----------
        paths : sequence of str
            The dimensions, in the order in which their numbers are given.
        wanted : str
            `points.H`, `points.H.y`, `links.rocker`, `slides.B`: the requested quantities.

        Returns
        -------
        Design
            `design(numbers, angle)` is (rows, n), x and y of a point in two rows; `design.slopes(numbers, angle)` is
            (rows, n, d + 1), the derivatives to the dimensions and last to the input.

        Raises
        ------
        DescriptionError
            A path or a name that is not there; more than one input.
        ValueError
            Two names of one number.

        Examples
        --------
        >>> from virtualwork import Input, Link
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1})}, inputs=Input("arm"))
        >>> at = arm.design(["links.arm.P.x"], "points.P")
        >>> at([2.0], [0.0]).tolist(), (at.slopes([2.0], [0.0])[:, 0] + 0.0).tolist()
        ([[2.0], [0.0]], [[1.0, 0.0], [0.0, 2.0]])
        """
        from virtualwork.describe.dimensions import named
        from virtualwork.family.design import Design, numbers_of_each

        dimensions = [dimension for path in paths for dimension in named(self, path)]
        return Design(self, dimensions, [key for of in numbers_of_each(self, wanted).values() for key in of])

    @cached_property
    def check(self) -> Check:
        """Return the character of the mechanism: mobility, redundant constraints, Grashof classes, limits, dead points."""
        from virtualwork.study.check import Check

        return Check(self.assembly)

    def equilibria(self, spans: ArrayLike | None = None, samples: int = 1440) -> Equilibria:
        """Return every position in which the mechanism rests under its loads without effort, and its stability.

        Parameters
        ----------
        spans : array (k, 2), optional
            The range of each input, rad or m. Default, also of an input whose row is NaN: from 0 on as many turns as the
            loads need to repeat; where they never repeat, a turn either way of the guess, or between the limits; for a slide,
            two sizes of the mechanism either way.
        samples : int
            The number of samples of a turn of one input, or of a shorter range.

        Raises
        ------
        AssemblyError
            The mechanism cannot be assembled anywhere in the range.

        Notes
        -----
        Q = Σ F·K + Σ T κ = 0 (J. A. Riul, Dinâmica das Máquinas, unit II, eq. 3); stable where V″ > 0 (Lagrange, Dirichlet).

        Examples
        --------
        >>> from virtualwork import Input, Link
        >>> pendulum = Mechanism({"O": 0j}, {"bob": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="bob"),
        ...                      gravity=-9.81j)
        >>> pendulum.equilibria()
        Equilibria(1.5708 unstable, 4.71239 stable)
        """
        from virtualwork.study.equilibrium import equilibria as search

        with self.assembly.lock:
            return search(self.assembly, spans, samples)

    def newton(self, *inputs: float, limit: int = 50) -> AllAtOnce:
        """Solve all loops at once by Newton-Raphson from the guess, with the table of iterates."""
        from virtualwork.study.newton_table import all_at_once

        place = tuple(as_number(value, "inputs") for value in inputs) or self.at
        if len(place) != len(self.inputs):
            raise ValueError(
                f"inputs: found {len(place)}, expected one number for each of {len(self.inputs)}"
            )
        with self.assembly.lock:
            return all_at_once(self.assembly, place, limit)

    def assemblies(self) -> tuple[Assembly, ...]:
        """Return every assembly at the input of the guess, the one that the guess chooses first."""
        from virtualwork.branch.solutions import all_assemblies

        with self.assembly.lock:
            return all_assemblies(self.assembly)
