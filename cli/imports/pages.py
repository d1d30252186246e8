"""The report of what was taken over: what there was, the mechanism as it is drawn, the file that was made."""

from __future__ import annotations

import tomllib

from cli.cases.posed import posed
from cli.show.report import CODE
from cli.show.result import Section, Sheet
from virtualwork import Mechanism
from virtualwork.describe import MechanismError


def pages(title: str, taken: list[str], made: str) -> list[Sheet]:
    """Return the sheets of a mechanism, and of its file; `taken` says from what it was taken over."""
    first = Section("Taken over", taken)
    file = Sheet("", [Section("The file for dalembert mechanism", [CODE + made.rstrip("\n")])])
    try:
        m = Mechanism.from_toml_text(made)
        inputs = tuple(at if e.value is None else e.value for e, at in zip(m.inputs, m.at, strict=True))
        return [posed(title, m, inputs, tomllib.loads(made).get("units", {}), first), file]
    except MechanismError as error:
        return [Sheet(title, [first, Section("Mechanism", [str(error)])]), file]
