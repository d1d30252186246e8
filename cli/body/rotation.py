"""A body and its state from TOML, its rotation in time, and what is constant in its motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cli.read.options import about
from dalembert.errors import DataError, toml_text
from dalembert.hints import nearest
from dalembert.quantities import decimals, exactly, expected, number_in_si
from dalembert.results.columns import document_unit, finite
from dalembert.tables.files import read_toml, remember
from dalembert.units import LARGEST
from dalembert.units import written as spelled
from rigidbody3d import Body, FreeBody, FreeState, Top, TopState, Trajectory, check, integrate, principal
from rigidbody3d import cones as cones_of
from rigidbody3d import sleeping_threshold as threshold_of
from rigidbody3d import steady_precession as steady_of
from rigidbody3d.attitude import normalize, rotate
from rigidbody3d.integration import MOST

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import DoubledArray

Array = NDArray[np.float64]

KEYS = ("name", "inertia", "parts", "omega", "attitude", "top", "torque", "frame", "report")
DIMENSIONS = {
    "inertia": "inertia",
    "omega": "speed",
    "attitude": "number",
    "top.mgl": "torque",
    "torque": "torque",
}


class Written(NamedTuple):
    """Numbers of the file, in SI, and as the file writes them."""

    numbers: Array
    texts: list[Any]
    dimension: str

    @property
    def exact(self) -> Any:
        """The numbers in 32 digits, with the decimals of the file exact."""
        from dalembert.arithmetic.doubled_arrays import DoubledArray
        from dalembert.arithmetic.doubled_operations import doubled_array

        parts = [decimals(text, self.dimension) for text in self.texts]
        exact = [exactly(*each) for each in parts if each is not None]
        return DoubledArray.of(doubled_array(exact, self.numbers.shape))


@dataclass(frozen=True)
class TurningBody:
    """The body as described."""

    file: str
    name: str
    inertia: Array
    omega: Array
    attitude: Array
    mgl: float | None
    torque: Array | None
    frame: str
    warnings: list[str]
    about: dict[str, str]
    """What the file says for the head of a report."""
    exact_tensor: Callable[[], DoubledArray] | None = None
    """The tensor of a body made of parts to 32 digits, (3, 3)."""
    written: Mapping[str, Written] = field(default_factory=dict)
    """The numbers of the file by their keys; an attitude of any length."""

    @property
    def forced(self) -> bool:
        """Whether a torque acts."""
        return self.torque is not None and bool(self.torque.any())

    def exact(self) -> TurningBody:
        """Return the body in doubled numbers, the decimals of the file exact."""
        from dalembert.tables.exact import plain

        def each(key: str, value: ArrayLike) -> Any:
            written = self.written.get(key)
            if written is None:
                return plain(value)
            numbers = normalize(written.numbers) if key == "attitude" else written.numbers
            return written.exact if np.array_equal(numbers, value) else plain(value)

        inertia: Any = each("inertia", self.inertia) if self.exact_tensor is None else self.exact_tensor()
        mgl = None if self.mgl is None else each("top.mgl", self.mgl)
        omega, attitude = each("omega", self.omega), each("attitude", self.attitude)
        return replace(self, inertia=inertia, omega=omega, attitude=attitude, mgl=mgl)


def read_body(path: str) -> TurningBody:
    """Read BODY.toml."""
    remember(path)
    file, document = read_toml(path)
    for key in document:
        if key not in KEYS:
            raise DataError(f"{file}: unknown key '{key}': expected {', '.join(KEYS)}{nearest(key, KEYS)}")
    written: dict[str, Written] = {}

    def numbers(key: str, value: object, *shapes: tuple[int, ...]) -> Array:
        written[key] = _written(file, key, value, *shapes)
        return written[key].numbers

    top = document.get("top")
    mgl = None
    if top is not None:
        if not isinstance(top, dict) or set(top) != {"mgl"}:
            raise DataError(f"{file}: [top] holds mgl = weight times distance, N·m, and nothing else")
        mgl = float(numbers("top.mgl", top["mgl"], ()))
    if ("inertia" in document) == ("parts" in document):
        raise DataError(f'{file}: expected inertia = [I1, I2, I3] (or a matrix) or parts = "parts.csv"')
    warnings: list[str] = []
    exact_tensor = None
    if "inertia" in document:
        inertia = numbers("inertia", document["inertia"], (3,), (3, 3))
    else:
        inertia, exact_tensor, warnings = _of_parts(file, path, document["parts"], mgl is not None)
    try:
        verdict = check(inertia)
    except ValueError as error:
        raise DataError(f"{file}: inertia: {error}") from None
    # a body of parts has been judged by what its table prints
    if "parts" not in document and not verdict.valid:
        raise DataError(f"{file}: inertia: no body has it: {verdict.reason}")
    if not verdict.moments[1] > 0:
        raise DataError(
            f"{file}: inertia: found no moment of inertia: expected at least two that are positive"
        )
    if "omega" not in document:
        raise DataError(f"{file}: no omega: expected the angular velocity in body axes, rad/s")
    torque = document.get("torque")
    frame = document.get("frame", "body")
    if frame not in ("body", "space"):
        raise DataError(f'{file}: frame: found {toml_text(frame)}, expected "body" or "space"')
    if "frame" in document and torque is None:
        warnings.append(f"{file}: frame: these are the axes of a torque, and there is none: not used")
    try:
        attitude = normalize(numbers("attitude", document.get("attitude", [1, 0, 0, 0]), (4,)))
    except ValueError as error:
        raise DataError(f"{file}: attitude: {error}") from None
    name = document.get("name", "")
    if not isinstance(name, str):
        raise DataError(f"{file}: name: found {toml_text(name)}, expected text in quotes")
    return TurningBody(
        file,
        name,
        inertia,
        numbers("omega", document["omega"], (3,)),
        attitude,
        mgl,
        None if torque is None else numbers("torque", torque, (3,)),
        frame,
        warnings,
        about(file, document),
        exact_tensor,
        written,
    )


def _of_parts(
    file: str, path: str, named: object, top: bool
) -> tuple[Array, Callable[[], DoubledArray], list[str]]:
    """Return the tensor of a table of parts, the same to 32 digits, and warnings."""
    if not isinstance(named, str):
        raise DataError(f"{file}: parts: found {toml_text(named)}, expected the name of a CSV file")
    from rigidbody3d.parts import read_parts

    parts = read_parts(str((Path() if path == "-" else Path(path).parent) / named))
    warnings = list(parts.warnings)
    if not top:
        return parts.whole.inertia, partial(_exact_tensor, parts.whole, None), warnings
    x, y, z = parts.whole.center.tolist()
    if np.hypot(x, y) > 1e-9 * abs(z):
        warnings.append(
            f"{parts.file}: the centre of mass lies at x = {x:g} m, y = {y:g} m: expected it on body z, the axis of a top"
        )
    point = [0.0, 0.0, 0.0]
    return parts.whole.about(point), partial(_exact_tensor, parts.whole, point), warnings


def _exact_tensor(body: Body, about: list[float] | None) -> DoubledArray:
    exact: Any = body.in_32_digits
    tensor: DoubledArray = exact.inertia if about is None else exact.about(about)
    return tensor


def _written(file: str, key: str, value: object, *shapes: tuple[int, ...]) -> Written:
    """Numbers of a key in an array of one of the shapes, bare in SI or with their units."""
    dimension = DIMENSIONS[key]
    try:
        texts = np.array(value, dtype=object)
        numbers = [number_in_si(x, dimension) for x in texts.ravel().tolist()]
        array = np.array([np.nan if x is None else x for x in numbers]).reshape(texts.shape)
    except ValueError:
        array = np.array([np.nan])
    if array.shape not in shapes or not (np.abs(array) <= LARGEST).all():
        wanted = " or ".join("×".join(map(str, shape)) if shape else "one" for shape in shapes)
        plural = "s" * (wanted != "one")
        units = (
            ""
            if dimension == "number"
            else f" in {spelled(document_unit(dimension))}, or {expected(dimension)}"
        )
        raise DataError(
            f"{file}: {key}: found {toml_text(value)}, expected {wanted} finite number{plural}{units}"
        )
    return Written(array, texts.ravel().tolist(), dimension)


DEFAULT_STEPS = 20_000
"""Steps of an integration without --method integrate: some seconds."""
EQUAL = 1e-12
"""Two principal moments as near as this, relatively, are those of a body of revolution."""


@dataclass(frozen=True)
class Rotation:
    """A body in time; each quantity is computed on the first request."""

    body: TurningBody
    time: Array
    method: str | None
    integrator: str

    @cached_property
    def round_moments(self) -> Array | None:
        """(I1, I1, I3) of a top whose axis is body z; None if it is no symmetric top."""
        I = self.body.inertia
        size = np.abs(I).max()
        if I.ndim == 2:
            if np.abs(I - np.diag(np.diag(I))).max() > EQUAL * size:
                return None
            I = np.diag(I)
        return None if abs(I[0] - I[1]) > EQUAL * size else _round(I)

    @cached_property
    def exact(self) -> bool:
        """Whether a closed form is used."""
        g = self.body
        closed = not g.forced and (not g.mgl or self.round_moments is not None)
        if self.method == "exact" and not closed:
            why = "a torque" if g.forced else "a top whose two moments across body z differ"
            raise DataError(f"{g.file}: there is no closed form for {why}: expected --method integrate")
        return closed and self.method != "integrate"

    @cached_property
    def states(self) -> FreeState | TopState | Trajectory:
        """The states at the times of the request."""
        return self.at(self.time)

    def at(self, time: Array) -> FreeState | TopState | Trajectory:
        """Return the states at other times."""
        g = self.body
        try:
            if self.exact:
                if g.mgl is None or self.round_moments is None:
                    return FreeBody(g.inertia, g.omega, g.attitude).at(time)
                return Top(self.round_moments, g.mgl, g.omega, g.attitude).at(time)
            return integrate(
                g.inertia,
                g.omega,
                g.attitude,
                time,
                torque=g.torque,
                frame=g.frame,
                mgl=g.mgl or 0.0,
                method=self.integrator,
                most=MOST if self.method == "integrate" else DEFAULT_STEPS,
            )
        except (ValueError, RuntimeError) as error:
            wait = (
                ", or --method integrate to wait for it"
                if self.method is None and "steps" in str(error)
                else ""
            )
            raise DataError(f"{g.file}: {error}{wait}") from None

    @cached_property
    def drift(self) -> dict[str, float | None]:
        """How far momentum and energy stray from those at time zero, relatively; None where they are not constant."""
        g = self.body
        if g.forced:
            return {"momentum": None, "energy": None}
        tensor = _tensor(g.inertia)
        H = rotate(g.attitude, tensor @ g.omega)
        w, x, y, z = g.attitude
        E = g.omega @ tensor @ g.omega / 2 + (g.mgl or 0.0) * (w * w + z * z - x * x - y * y)
        stray = self.states.momentum - H
        if g.mgl is not None:  # about the vertical only
            stray = stray[:, 2:]
        size = float(np.linalg.norm(H))
        scale = max(abs(float(E)), abs(g.mgl or 0.0))
        energy = float(np.abs(self.states.energy - E).max())
        momentum = float(np.linalg.norm(stray, axis=-1).max())
        return {
            "momentum": momentum / size if size else momentum,
            "energy": energy / scale if scale else energy,
        }

    @cached_property
    def period(self) -> float | None:
        """The period of ω in body axes; None where it is constant, or not periodic."""
        if not self._free or self._like(0, 2):
            return None
        return finite(float(_period(self.body)))

    def cones(self) -> dict[str, float | None] | None:
        """Return the cones of a free symmetric body."""
        if self._pole is None:
            return None
        return {name: float(value) for name, value in _cones(self.body, self._pole).items()}

    def steady(self) -> dict[str, float | None] | None:
        """Return the rates of steady precession of a top at its tilt at time zero."""
        if self.body.mgl is None or self.round_moments is None:
            return None
        rates = _steady(self.body, self.round_moments)
        if not self.round_moments[2]:
            return {name: finite(float(rates[name])) for name in ("slow_rad_s", "fast_rad_s")} | {
                "sleeping_threshold_rad_s": None
            }
        return {name: finite(float(value)) for name, value in rates.items()}

    @property
    def nutation_period(self) -> float | None:
        """The period of nutation of a top; None of any other body."""
        return finite(float(self.states.top.nutation_period)) if isinstance(self.states, TopState) else None

    @property
    def _free(self) -> bool:
        return not self.body.forced and self.body.mgl is None

    @cached_property
    def _pole(self) -> int | None:
        """Which principal axis is that of a free body of revolution; None of a sphere, or of three different moments."""
        oblate, prolate = self._like(0, 1), self._like(1, 2)
        return None if not self._free or oblate == prolate else 2 if oblate else 0

    def _like(self, one: int, other: int) -> bool:
        """Whether two principal moments are equal to rounding."""
        moments = self._moments
        return bool(moments[other] - moments[one] <= EQUAL * moments[2])

    @cached_property
    def _moments(self) -> Array:
        """The principal moments, ascending."""
        return principal(self.body.inertia).moments

    def constant_error(self, name: str, value: float) -> Array:
        """The error of a period, or of a number of cones or of steady precession, by computing twice."""
        exact: Any = self._exact_constants[name]
        off: Array = exact.off(value)
        return np.atleast_1d(np.where(np.isnan(off), np.inf, off))

    @cached_property
    def _exact_constants(self) -> dict[str, Any]:
        body: Any = self.body.exact()
        if self._free:
            cones = {} if self._pole is None else _cones(body, self._pole)
            return {"period": _period(body), **cones}
        moments = body.inertia if body.inertia.ndim == 1 else np.diagonal(body.inertia)
        nutation = self._exact[0].top.nutation_period if isinstance(self.states, TopState) else None
        return {"nutation_period": nutation, **_steady(body, _round(moments))}

    def errors(self, of: str) -> Array:
        """The errors of a quantity of the states by computing twice, of an integration of its method too."""
        s, exact = self.states, self._exact
        if isinstance(s, Trajectory):
            return s.error_estimate(of, exact)
        errors = s.error_estimate(of, exact[0])
        if len(exact) > 1:
            # two moments that differ by rounding were taken as one
            errors = 3 * errors + 2 * s.error_estimate(of, exact[1])
        return np.asarray(errors)

    @cached_property
    def _exact(self) -> Any:
        """The states in doubled numbers; of an integration the tensor alone."""
        body = self.body.exact()
        I: Any = body.inertia
        if isinstance(self.states, Trajectory):
            return I if I.ndim == 2 else I[:, None] * np.eye(3)
        from dalembert.tables.exact import array

        time: Any = array(self.time)
        if isinstance(self.states, FreeState):
            return [FreeBody(I, body.omega, body.attitude).at(time)]
        mgl: Any = body.mgl
        moments = I if I.ndim == 1 else np.diagonal(I)
        each = [_round(moments), *([moments[[0, 0, 2]]] if (moments[0] != moments[1]).any() else [])]
        return [Top(about, mgl, body.omega, body.attitude).at(time) for about in each]


def _period(g: TurningBody) -> Any:
    return FreeBody(g.inertia, g.omega).period


def _cones(g: TurningBody, pole: int) -> dict[str, Any]:
    """The cones of a free body of revolution, of floats or of doubled numbers."""
    moments, axes = principal(g.inertia)
    order = [(pole + 1) % 3, (pole + 2) % 3, pole]
    result = cones_of(moments[order[0]], moments[pole], (axes @ g.omega)[order])
    return {
        "space_half_angle_deg": np.degrees(result.space),
        "body_half_angle_deg": np.degrees(result.body),
        "precession_rad_s": result.precession,
        "spin_rad_s": result.spin,
    }


def _steady(g: TurningBody, moments: Array) -> dict[str, Any]:
    """The rates of steady precession of a top with moments (3,), of floats or of doubled numbers."""
    mgl: Any = g.mgl
    w, x, y, z = g.attitude
    tilt = 2 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
    rates = steady_of(moments[0], moments[2], mgl, tilt, g.omega[2])
    threshold = threshold_of(moments[0], moments[2], mgl)
    return {"slow_rad_s": rates.slow, "fast_rad_s": rates.fast, "sleeping_threshold_rad_s": threshold}


def _round(I: Array) -> Array:
    """Moments (I1, I1, I3) of those of a top, (3,)."""
    return (I[[0, 1, 2]] + I[[1, 0, 2]]) / 2


def _tensor(inertia: Array) -> Array:
    return np.diag(inertia) if inertia.ndim == 1 else inertia
