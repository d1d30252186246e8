"""What can be asked of poses, each quantity by its key, and what it is called on a tape."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from dalembert.arithmetic.engines import Outputs

# (kind, of what …): see `recording.Recording.value`
Key = tuple[Any, ...]
# what the loads have a part in; a pose that is not assembled has none of it
FORCES = {
    "effort",
    "newton-euler",
    "force",
    "moment",
    "reaction",
    "shaking",
    "shaking moment",
    "generalized",
    "applied",
    "applied moment",
    "contact",
    "load",
    "load at",
    "load torque",
    "rail",
    "entry",
    "bearing",
    "rubbing",
}
# of these, what no friction changes
UNRUBBED = {"shaking", "shaking moment", "load", "load at", "load torque", "rail", "rubbing"}
# what the joints carry
JOINTS = {"newton-euler", "force", "moment", "reaction", "contact", "rail"}
# what has two parts
COMPLEX = {"point", "turn", "dpoint", "force", "reaction", "shaking", "applied", "gap", "column", "load", "load at", "rail", "bearing", "group column", "right side"}  # fmt: skip


def names(key: Key) -> tuple[str, ...]:
    """What the outputs of a quantity are called on the tape: one, or two where it is complex.

    >>> names(("angle", "crank", 1)), names(("force", "pin:B", "coupler"))
    (('angle crank 1',), ('force pin:B coupler x', 'force pin:B coupler y'))
    """
    text = " ".join(repr(part) if isinstance(part, complex) else str(part) for part in key)
    return (f"{text} x", f"{text} y") if key[0] in COMPLEX else (text,)


def quantity(rows: Outputs, key: Key, n: int, to: str | None = None) -> Any:
    """A quantity of n lanes from the rows of a run, or its derivative `to` an input: (n,), real or complex.

    What does not depend on the input has no row. A row of the run's own table is not copied.
    """
    of = [name if to is None else f"d({name})/d({to})" for name in names(key)]
    value = rows.get(of[0], 0.0) if len(of) == 1 else rows.complex(*of)
    return value if np.ndim(value) else np.full(n, value)
