"""A body and its state from TOML: inertia or parts, angular velocity, attitude, torque, top."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.errors import DataError, toml_text
from dalembert.hints import nearest
from dalembert.quantities import decimals, exactly, expected, number_in_si
from dalembert.results.about import about
from dalembert.results.columns import document_unit
from dalembert.tables.files import read_toml, remember
from dalembert.units import LARGEST
from dalembert.units import written as spelled
from rigidbody3d.attitude import normalize
from rigidbody3d.body import Body
from rigidbody3d.inertia import check

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
    """Read a body and its state: `inertia` or `parts`, `omega`, `attitude`, `torque`, `[top]` (docs/rigid-body.md).

    Raises
    ------
    DataError
        The file cannot be read, has an unknown key, or describes no body that turns.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "body.toml")
    ...     _ = file.write_text('inertia = [1, 2, 3]\\nomega = [0, "60 rpm", 0.1]\\n')
    ...     body = read_body(str(file))
    >>> body.omega.round(6), body.forced
    (array([0.      , 6.283185, 0.1     ]), False)
    """
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
