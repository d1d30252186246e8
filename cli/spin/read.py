"""A body and its state from TOML."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cli.errors import DataError, nearest
from cli.read.about import about
from cli.read.files import read_bytes, remember
from cli.read.units import LARGEST
from rigidbody3d import Body, check
from rigidbody3d.attitude import normalize

Array = NDArray[np.float64]

KEYS = ("name", "inertia", "parts", "omega", "attitude", "top", "torque", "frame", "report")


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
    rounded: Callable[[], Array] | None = None
    """Bounds of the errors of the tensor of a body made of parts, (3, 3)."""


def read_body(path: str) -> TurningBody:
    """Read BODY.toml."""
    remember(path)
    file, data = read_bytes(path)
    try:
        document = tomllib.loads(data.decode("utf-8-sig"))
    except ValueError as error:
        raise DataError(f"{file}: {error}") from None
    except RecursionError:
        raise DataError(f"{file}: no valid TOML: nested too deeply") from None
    for key in document:
        if key not in KEYS:
            raise DataError(f"{file}: unknown key '{key}': expected {', '.join(KEYS)}{nearest(key, KEYS)}")
    top = document.get("top")
    mgl = None
    if top is not None:
        if not isinstance(top, dict) or set(top) != {"mgl"}:
            raise DataError(f"{file}: [top] holds mgl = weight times distance, N·m, and nothing else")
        mgl = float(_numbers(file, "top.mgl", top["mgl"], ()))
    inertia, rounded, warnings = _inertia(file, path, document, mgl is not None)
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
        raise DataError(f'{file}: frame: found {frame!r}, expected "body" or "space"')
    attitude = _numbers(file, "attitude", document.get("attitude", [1, 0, 0, 0]), (4,))
    try:
        attitude = normalize(attitude)
    except ValueError as error:
        raise DataError(f"{file}: attitude: {error}") from None
    return TurningBody(
        file,
        str(document.get("name", "")),
        inertia,
        _numbers(file, "omega", document["omega"], (3,)),
        attitude,
        mgl,
        None if torque is None else _numbers(file, "torque", torque, (3,)),
        frame,
        warnings,
        about(file, document),
        rounded,
    )


def _inertia(
    file: str, path: str, document: Mapping[str, object], top: bool
) -> tuple[Array, Callable[[], Array] | None, list[str]]:
    """Return the tensor, what bounds its errors where it is that of parts, and warnings."""
    if ("inertia" in document) == ("parts" in document):
        raise DataError(f'{file}: expected inertia = [I1, I2, I3] (or a matrix) or parts = "parts.csv"')
    if "inertia" in document:
        return _numbers(file, "inertia", document["inertia"], (3,), (3, 3)), None, []
    named = document["parts"]
    if not isinstance(named, str):
        raise DataError(f"{file}: parts: found {named!r}, expected the name of a CSV file")
    from cli.read.parts import read_parts

    parts = read_parts(str((Path() if path == "-" else Path(path).parent) / named))
    point = [0.0, 0.0, 0.0] if top else None
    inertia = parts.whole.inertia if point is None else parts.whole.about(point)
    return inertia, partial(_tensor_error, parts.whole, point), parts.warnings


def _tensor_error(body: Body, about: list[float] | None) -> Array:
    return body.error_estimate(about).inertia


def _numbers(file: str, key: str, value: object, *shapes: tuple[int, ...]) -> Array:
    wanted = " or ".join("×".join(map(str, shape)) if shape else "one" for shape in shapes)

    def plain(x: object) -> bool:
        return (
            all(map(plain, x))
            if isinstance(x, list)
            else isinstance(x, (int, float)) and not isinstance(x, bool)
        )

    try:
        array = np.array(value, dtype=float) if plain(value) else np.array([np.nan])
    except (ValueError, OverflowError):
        array = np.array([np.nan])
    if array.shape not in shapes or not (np.abs(array) <= LARGEST).all():
        raise DataError(
            f"{file}: {key}: found {value!r}, expected {wanted} finite number{'s' * (wanted != 'one')}"
        )
    return array
