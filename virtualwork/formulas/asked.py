"""What can be asked of poses, each quantity by its key, and what it is called on a tape; and whether the tape pays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from dalembert.arithmetic.choice import wanted
from virtualwork.formulas.poses import Poses

if TYPE_CHECKING:
    from dalembert.arithmetic.engines import Outputs
    from virtualwork.formulas.dynamics import Dynamics

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
}
# what the joints carry
JOINTS = {"newton-euler", "force", "moment", "reaction"}
# what has two parts
COMPLEX = {"point", "turn", "dpoint", "force", "reaction", "shaking", "applied", "gap", "column"}
# times that one pose is asked for, and poses, from which on the tape pays
OFTEN = 50
MANY_POSES = 1_000_000


def pays(asked: dict[Any, int], n: int, keys: Sequence[Key]) -> Literal["blocks", "one", "lanes"]:
    """The way that pays: blocks of arrays, one pose by a function of floats, or lanes of the tape.

    One pose: some milliseconds to write down against some ten microseconds each time, so it must be asked for often.
    Very many: where compiled code may run, and what it takes to make it is less than what it saves. `asked` counts for an
    assembly.
    """
    if wanted():
        return "lanes"
    key = n == 1, *keys
    asked[key] = asked.get(key, 0) + n
    if n == 1:
        return "one" if asked[key] > OFTEN else "blocks"
    if asked[key] <= MANY_POSES:
        return "blocks"
    from dalembert.arithmetic.engines import compiled_code

    return "lanes" if compiled_code() else "blocks"


def over_blocks(poses: Poses, key: Key, forces: Dynamics | None = None) -> Any:
    """A quantity worked out over blocks of poses, (n,)."""
    kind, *of = key
    if kind in FORCES:
        if forces is None:
            # a dozen files: a scene without forces does not load them
            from virtualwork.formulas.dynamics import Dynamics

            forces = Dynamics(poses)
        if kind == "effort":
            return forces.effort[:, of[0]]
        if kind == "generalized":
            return forces.generalized[:, of[0]]
        if kind.startswith("applied"):
            return forces.applied(of[0])[kind != "applied"]
        if kind == "newton-euler":
            return forces.newton_euler[:, of[0]]
        if kind.startswith("shaking"):
            force, moment = forces.shaking
            return moment if kind == "shaking moment" else force[:, 0] + 1j * force[:, 1]
        if kind == "reaction":
            return forces.at_joint(*of)
        joint = forces.reactions.by_key[of[0]]
        return forces.joint_force(joint, of[1]) if kind == "force" else forces.joint_moment(joint, of[1])
    return poses.values((key,))[0]


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
