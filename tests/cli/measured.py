"""Tables of runs that the tests of `dalembert field` read, and what is asked of the answer."""

from __future__ import annotations

import subprocess
from typing import Any

import numpy as np

from tests.cli.printed import document

HEAD = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"


def table(*rows: str, head: str = HEAD) -> str:
    return "\n".join([head, *rows]) + "\n"


def cell(value: complex) -> str:
    return f"{float(abs(value))!r},{float(np.degrees(np.angle(value)))!r}"


ALPHA = np.array([[2 + 1j, 1 - 1j], [-1 + 3j, 2 + 2j], [1 + 0j, 1j]])
W = np.array([3 * np.exp(1j * np.radians(20)), 5 * np.exp(1j * np.radians(300))])
V0 = -ALPHA @ W
FAN = table("0,1,3.4,116,,,", "1,1,1.8,42,A,2,0")


def runs(*masses: str, on: Any, head: str = HEAD + ",trial_kept", v0: Any = V0) -> str:
    """Runs of the rotor above: `masses` the trial cells of each run, `on` what was on."""
    rows = [f"0,{s},{cell(v)},,,," for s, v in enumerate(v0)]
    for r, (text, t) in enumerate(zip(masses, on, strict=True)):
        rows += [f"{r + 1},{s},{cell(v)},{text}" for s, v in enumerate(v0 + ALPHA @ np.asarray(t))]
    return table(*rows, head=head)


def corrections(done: subprocess.CompletedProcess[str], key: str = "mass_kg") -> Any:
    entries = document(done)["rotors"][0]["corrections"]
    return np.array([e[key] * np.exp(1j * np.radians(e["angle_deg"])) for e in entries])
