"""Which forces are asked for, and how the JSON document has them: effort, reactions, shaking force."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.mechanism.poses import cells, pair

if TYPE_CHECKING:
    from cli.mechanism.solve import Analysis
    from cli.show.columns import Document
    from virtualwork.motion import Motion
    from virtualwork.plan.steps import Joint


def effort_name(slide: bool) -> str:
    """`torque_N_m` of a turning input, `force_N` of a slide."""
    return "force_N" if slide else "torque_N_m"


def rows_of(analysis: Analysis, motion: Motion) -> list[tuple[Joint, str, str]]:
    """The reactions asked for: (joint, on, from), each pair once, `on` the later in the file."""
    return [
        (joint, on, of)
        for joint, on, of in motion.dynamics.reactions.order.pairs
        if analysis.only is None or {joint.name, on, of} & set(analysis.only)
    ]


def with_forces(listed: list[Document], analysis: Analysis) -> list[Document]:
    """The JSON's poses, with the forces of each."""
    return [pose | part for pose, part in zip(listed, poses(analysis), strict=True)]


def poses(analysis: Analysis) -> list[Document]:
    """Effort, reactions and shaking force of every pose, in the order of the JSON's poses."""
    parts = [_motion_parts(analysis, motion) for motion in analysis.motions]
    return [part[i] for i in range(len(analysis.inputs.shown)) for part in parts]


def _motion_parts(analysis: Analysis, motion: Motion) -> list[Document]:
    d, inputs = motion.dynamics, analysis.mechanism.inputs
    d.solve([(joint, on) for joint, on, _ in rows_of(analysis, motion)])
    work, euler = ([cells(values[:, j]) for j in range(len(inputs))] for values in (d.effort, d.newton_euler))
    reactions = []
    for joint, on, of in rows_of(analysis, motion):
        force = d.joint_force(joint, on)
        columns = (*pair(force), cells(d.joint_moment(joint, on)))
        reactions.append(({"joint": joint.name, "on": on, "from": of}, columns))
    shaking, moment = d.shaking
    shake = cells(shaking[:, 0]), cells(shaking[:, 1]), cells(moment)
    found: list[Document] = []
    for i in range(motion.n):
        efforts = []
        for j, entry in enumerate(inputs):
            name = effort_name(entry.is_slide)
            efforts.append({f"input_{name}": euler[j][i], f"virtual_work_{name}": work[j][i]})
        found.append(
            {
                "effort": efforts[0]
                if len(inputs) == 1
                else {"inputs": {e.name: part for e, part in zip(inputs, efforts, strict=True)}},
                "reactions": [
                    {**names, "fx_N": fx[i], "fy_N": fy[i], "moment_N_m": m[i]}
                    for names, (fx, fy, m) in reactions
                ],
                "shaking": {"fx_N": shake[0][i], "fy_N": shake[1][i], "moment_N_m": shake[2][i]},
            }
        )
    return found


def acts_by_friction(motion: Motion, joint: Joint, on: str) -> bool:
    """Whether a pin's friction has a moment on a body: its column stands in every block of a sweep."""
    return any(
        r.path is None and r.joint == joint.key and r.body == on for r in motion.dynamics.scene.friction
    )
