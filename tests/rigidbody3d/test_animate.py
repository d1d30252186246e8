"""The page of a rotation, asked of the library's own states."""

from __future__ import annotations

import base64
import json
import re
from typing import Any

import numpy as np
import pytest

from dalembert.page import Page
from rigidbody3d.freebody import FreeBody
from rigidbody3d.integration import integrate
from rigidbody3d.top import Top


def columns(page: Page) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, Any]]:
    """Return the columns of a page, and all of its data."""
    held = json.loads(re.search(r"<script[^>]*application/json[^>]*>(.*?)</script>", page.html, re.S)[1])  # type: ignore[index]
    (series,) = held["series"]
    found = {}
    for c in series["columns"]:
        packed = np.full(series["n"], c["all"]) if "all" in c else np.frombuffer(base64.b64decode(c["f8"]))
        found[c["header"]] = packed
    return found, held


def test_a_free_body() -> None:
    """A body of revolution: ω_z stays, ω_x = cos(Ω t) with Ω = (I_z − I)/I·ω_z."""
    t = np.linspace(0, 20, 101)
    shown, held = columns(FreeBody([2, 2, 3], [1.0, 0.0, 4.0]).at(t).animate())
    assert (shown["t_s"] == t).all()
    assert (held["clock"], held["traced"]) == (0, "body z")
    np.testing.assert_allclose(shown["omega_x_rad_s"], np.cos(2 * t), atol=1e-12)
    np.testing.assert_allclose(shown["omega_z_rad_s"], 4, rtol=1e-14)
    # (2·1² + 3·4²)/2 J
    np.testing.assert_allclose(shown["energy_J"], 25, rtol=1e-14)


def test_a_top_stands_on_its_tip() -> None:
    """Its page is a cone, whose axis is body z; asleep it keeps its attitude's axis upright."""
    top = Top([2, 2, 1], 5.0, [0.0, 0.0, 30.0])
    shown, held = columns(top.at(np.linspace(0, 1, 11)).animate())
    assert held["axis"] == [0, 0, 1]
    assert held["solid"]["corners"][-1] == [0, 0, 0]
    np.testing.assert_allclose(shown["attitude_x"], 0, atol=1e-15)
    np.testing.assert_allclose(shown["omega_z_rad_s"], 30, rtol=1e-14)


def test_what_was_integrated_moves_as_the_closed_form() -> None:
    t = np.linspace(0, 5, 21)
    free, _ = columns(FreeBody([1, 2, 3], [1.0, 0.1, 0.5]).at(t).animate())
    shown, _ = columns(integrate([1, 2, 3], [1.0, 0.1, 0.5], t=t).animate())
    assert shown.keys() == free.keys()
    for name, values in free.items():
        np.testing.assert_allclose(shown[name], values, rtol=0, atol=1e-10)


def test_several_bodies_are_refused() -> None:
    for body, t in (
        (FreeBody([1, 2, 3], np.ones((2, 3))), [0.0, 1.0]),
        (FreeBody([1, 2, 3], np.ones(3)), 1.0),
    ):
        with pytest.raises(ValueError, match="one body at several times"):
            body.at(t).animate()
