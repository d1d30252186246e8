"""What is exported as SDF, read by libsdformat as Drake has it (`pip install drake`, 170 MB with a proprietary solver:

therefore in no extra, and skipped where it is not installed).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.test_export import FILES, exported, home
from virtualwork import Mechanism


def placed(plant: Any, start: Any) -> tuple[dict[str, Any], list[float]]:
    """Each body where the frames of the joints put it, the world standing still, and how far each loop is open."""
    places, gaps = {"world": start}, []
    left = [plant.get_joint(index) for index in plant.GetJointIndices()]
    while left:
        joint = next(j for j in left if {j.parent_body().name(), j.child_body().name()} & places.keys())
        left.remove(joint)
        parent, child = joint.parent_body().name(), joint.child_body().name()
        on_parent = joint.frame_on_parent().GetFixedPoseInBodyFrame()
        on_child = joint.frame_on_child().GetFixedPoseInBodyFrame()
        if child not in places:
            places[child] = places[parent] @ on_parent @ on_child.inverse()
        elif parent not in places:
            places[parent] = places[child] @ on_child @ on_parent.inverse()
        else:
            ends = (places[parent] @ on_parent).GetAsMatrix34() - (places[child] @ on_child).GetAsMatrix34()
            gaps.append(float(np.abs(ends).max()))
    return places, gaps


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.parent.name)
def test_masses_and_places_are_ours(file: Path) -> None:
    parsing = pytest.importorskip("pydrake.multibody.parsing", reason="libsdformat: pip install drake")
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import MultibodyPlant

    m = Mechanism.from_toml(file)
    if m.gears:
        pytest.skip("Drake knows no joint of type gearbox")
    plant = MultibodyPlant(0.0)
    parsing.Parser(plant).AddModelsFromString(exported(m, ".sdf").decode(), "sdf")
    places, gaps = placed(plant, RigidTransform())
    assert max(gaps, default=0.0) <= 1e-14 * max(m.size, 1.0)
    pose = m.motion(np.array([home(m)]) if len(m.at) > 1 else np.array(home(m)))
    for name, link in m.links.items():
        held = m.rigid[name].mass
        assert not held or plant.GetBodyByName(name).default_mass() == held
        for point, z in link.points.items():
            at = places[name].multiply(np.array([z.real, z.imag, 0.0]))
            assert at[:2] == pytest.approx(pose.point(point).position[0], abs=1e-14 * m.size), (name, point)
