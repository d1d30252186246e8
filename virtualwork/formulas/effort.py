"""The effort at the inputs by virtual work: the velocity coefficients are the virtual displacements.

For a unit of input j every point moves by K_j = ∂P/∂q_j and every link turns by κ_j = ∂θ/∂q_j, so that by
d'Alembert's principle (Riul, unit II, eqs. 3 and 5, divided by the input's own displacement)

    τ_j + Σ F·K_j + Σ T κ_j = 0,      F, T with the inertia loads −m a_G and −I α.

Joint forces do no work and do not appear. A load whose point cannot move has no K and is never evaluated.

Every K_j is Σ i z e^{iθ} κ_j over the links between the ground and the point. The effort gathers the loads by links
first, Q_θ = Σ T + Σ (z e^{iθ}) × F, and is −Σ Q_θ κ_j; the ledger takes the loads one by one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from virtualwork.formulas.block import Block
from virtualwork.formulas.kinematics import AnglePartial
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.numbers import Number, Reals, plus, times
from virtualwork.formulas.positions import BLOCK
from virtualwork.formulas.scene import Scene


def effort(scene: Scene) -> Reals:
    """The effort at each input by virtual work, (n, k): N·m at a turning input, N at a slide."""
    return through_carriers(scene, generalized(scene))


def generalized(scene: Scene) -> Reals:
    """What balances the loads at each input, (n, k), as if every motor sat on the body that its angle is measured from."""
    out = np.zeros((scene.poses.n, len(scene.mechanism.inputs)))

    def work(block: Block) -> None:
        for j in range(out.shape[1]):
            total = generalized_force(scene.paths, block, j)
            if total is not None:
                np.negative(total, out=out[block.rows, j])
                bad = _singular(scene, block, j)
                if bad is not False:
                    out[block.rows, j][bad] = np.nan
        if scene.poses.n > BLOCK:
            block.forget(lasting=True)

    scene.each((), work)
    if scene.lost is not None:
        out[scene.lost] = np.nan
    # no −0
    out += 0.0
    return out


def generalized_force(paths: LoadPaths, block: Block, j: int) -> Number:
    """What the loads do for a unit of input j over one block; None where nothing."""
    total: Number = None
    for body, guide, load in paths.working:
        moved = block.by[j].slide[guide][0] if body is None else block.turning(body, j)
        # what cannot move is not evaluated
        if moved is not None:
            value = paths.value(block, load)
            total = plus(total, value if isinstance(moved, float) and moved == 1 else times(value, moved))
    return total


def _singular(scene: Scene, block: Block, j: int) -> Any:
    """Where a link turns more than 10¹³ times as fast as the input: at a dead point to rounding, no number is left."""
    reach = scene.mechanism.size if scene.mechanism.inputs[j].is_slide else 1.0
    result: Any = False
    for group in scene.plan.groups:
        for body in group.angles:
            known = block.by[j].angle.get(body)
            if not known or known[0] is None:
                continue
            # the norm over the block is above its largest entry: in most blocks it says that no link is so fast
            if not np.sqrt(np.vdot(known[0], known[0])) * reach < 1e13:
                result = result | ~(np.abs(known[0]) * reach < 1e13)
    return result


def through_carriers(scene: Scene, force: Reals) -> Reals:
    """Turn generalized forces at the inputs into motor torques, where a motor sits on another body than `on`.

    A motor's torque T acts on the driven link and −T on its carrier (Ibrahim §2.3), so Σ_j T_j ∂(θ_driven − θ_carrier)_j/∂q_i
    is the generalized force i.
    """
    inputs = scene.mechanism.inputs
    k = len(inputs)
    if not scene.mechanism.carried:
        return force
    poses = scene.poses
    matrix = np.broadcast_to(np.eye(k), (poses.n, k, k)).copy()
    for j in scene.mechanism.carried:
        for i in range(k):
            bodies = str(inputs[j].link), scene.mechanism.carrier(j)
            driven, carrier = poses.values([AnglePartial(body, i, 1) for body in bodies])
            matrix[:, i, j] = driven - carrier
    if k == 1:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(force / matrix[:, 0])
    good: Any = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(force).all(axis=1)
    out = np.full_like(force, np.nan)
    safe = np.where(good[:, None, None], matrix, np.eye(k))
    # the volume of the rows over the product of their lengths (Hadamard): a slide's row has a unit of its own
    lengths = np.sqrt((safe * safe).sum(axis=2)).prod(axis=1)
    regular: Any = np.asarray(good & (np.abs(np.linalg.det(safe)) > 1e-14 * lengths))
    out[regular] = np.linalg.solve(matrix[regular], force[regular][..., None])[..., 0]
    return out


def ledger(scene: Scene, j: int = 0) -> tuple[dict[str, Reals], list[str], list[str]]:
    """Each load's virtual work for a unit of input j, which loads do none, and which are absent.

    Returns
    -------
    works : dict of load name to (n,), N·m (or N for a slide)
    workless : list of str
        Loads that act where nothing can move: they were left out.
    absent : list of str
        Kinds of loads that the scene does not have, and why.
    """
    works: dict[str, Reals] = {}
    workless: list[str] = []
    for block in scene.blocks():
        for load in scene.case.everything:
            value = load.power(block, j)
            if value is None:
                if load.displacement(block, j) is None and load.name not in workless and load.carries:
                    workless.append(load.name)
                continue
            known = works.setdefault(load.name, np.zeros(scene.poses.n))
            known[block.rows] += value
    return works, [name for name in workless if name not in works], absent(scene)


def absent(scene: Scene) -> list[str]:
    """Which terms of eq. (5) the scene does not have, and why: they are never formed."""
    m, found = scene.mechanism, []
    massless = [body for body, r in scene.rigid.items() if not r.mass]
    if massless:
        found.append(f"{', '.join(massless)}: no weight and no inertia force, for there is no mass")
    flat = [body for body, r in scene.rigid.items() if r.mass and not r.inertia]
    if flat:
        found.append(f"{', '.join(flat)}: no inertia torque, for there is no inertia")
    if not m.gravity:
        found.append("no weights: gravity is zero")
    if not scene.moves:
        found.append("no inertia loads, no damping, no friction: speed and acceleration are zero")
    for what, entries in (
        ("applied forces", m.forces),
        ("applied torques", m.torques),
        ("springs", m.springs),
    ):
        if not entries:
            found.append(f"no {what} in the file")
    return found
