"""Three parallel cranks: statics determines what acts across the cranks, and not how they share what acts along them."""

from __future__ import annotations

import json

import pytest

CRANKS = """gravity = [0, -10]
[units]
angle = "deg"
[ground]
A = [0, 0]
B = [1, 0]
C = [2, 0.1]
[links.a]
points = { A = [0, 0], D = [0.5, 0] }
mass = 1
center = [0.25, 0]
[links.b]
points = { B = [0, 0], E = [0.5, 0] }
mass = 2
center = [0.25, 0]
[links.c]
points = { C = [0, 0], F = [0.5, 0] }
mass = 4
center = [0.25, 0]
[links.bar]
points = { D = [0, 0], E = [1, 0], F = [2, 0.1] }
[input]
link = "a"
angle = 40
[guess]
at = 40
b = 40
c = 40
bar = 0
"""


@pytest.mark.parametrize(("at", "across"), [(0, "fy"), (90, "fx"), (180, "fy"), (270, "fx"), (40, None)])
def test_the_component_that_is_determined_has_a_number(dalembert, tmp_path, at, across):
    (tmp_path / "m.toml").write_text(CRANKS)
    for more in ((), ("--at", "200")):
        found = json.loads(dalembert("forces", "m.toml", "--at", str(at), *more, "--json").stdout)
        rows = {(r["joint"], r["on"]): r for r in found["poses"][0]["reactions"]}
        for pin, link, half in (("B", "b", 10), ("C", "c", 20)):
            row = rows[pin, link]
            along = {"fx": "fy", "fy": "fx"}.get(across)
            if across is None:
                assert row["fx_N"] is row["fy_N"] is None
            elif link == "c" and across == "fy":
                # the third crank lies beside the others: its own share is determined there
                assert row["fx_N"] is not None
                assert row["fy_N"] == pytest.approx(half, abs=1e-9)
            else:
                assert row[f"{along}_N"] is None
                # a free bar at rest: its two pins bear half of its weight across, none where it hangs upright
                assert row[f"{across}_N"] == pytest.approx(half if across == "fy" else 0, abs=1e-9)
                assert f"{along} at {pin} on {link}" in found["warnings"][0]
                assert f"{across} at {pin} on {link}" not in found["warnings"][0] or more
