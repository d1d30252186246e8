"""Watt I six-bar of PMKS_Verification (MATLAB R2024a cross-checked against PMKS): torque and every reaction."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from virtualwork import Force, Guess, Input, Link, Mechanism

JOINTS = {
    "A": (-3.74 - 2.41j),
    "B": (-2.72 + 0.91j),
    "C": (1.58 + 0.43j),
    "D": (-0.24 + 4.01j),
    "E": (5.08 + 5.31j),
    "F": (8.14 + 3.35j),
    "G": (7.32 - 3.51j),
}
# link: joints, mass, inertia, centre of mass
LINKS = {
    "AB": ("AB", 5, 0.1, (-3.23 - 0.75j)),
    "BCD": ("BCD", 10, 0.2, (-0.46 + 1.7833333333333334j)),
    "CFG": ("CFG", 5, 0.1, (5.68 + 0.09j)),
    "DE": ("DE", 5, 0.1, (2.42 + 4.66j)),
    "EF": ("EF", 10, 0.2, (6.61 + 4.33j)),
}
ON = {
    "A": "AB",
    "B": "AB",
    "C": "BCD",
    "D": "BCD",
    "E": "DE",
    "F": "EF",
    "G": "CFG",
}  # the link on which each printed reaction acts
POSES: Any = [
    {
        "angle": 0.0,
        "newton_gravity": (
            1844.317472993056,
            {
                "A": (-617.2887070878846, -176.5348377830598),
                "B": (614.4923191742427, 216.48286927983295),
                "C": (417.9028063245323, -49.763470876510645),
                "D": (197.86310237893218, 100.67854343389192),
                "E": (199.9988127628758, -3.3391333188193983),
                "F": (-112.55851511205553, -52.45261961771973),
                "G": (152.2357617052428, -150.95805411779756),
            },
        ),
        "newton_no_gravity": (
            1474.5549914266414,
            {
                "A": (-556.9171920480127, -367.06871193407915),
                "B": (554.1208041343707, 357.9667434308523),
                "C": (274.3847789141274, -51.22235350776437),
                "D": (281.0096147494651, 145.521300216165),
                "E": (283.1453251334087, -7.5463765365463304),
                "F": (-29.412002741522674, -154.75986283544665),
                "G": (91.86424666537079, -303.7741799667782),
            },
        ),
        "speed": 1.0471975511965976,
    },
    {
        "angle": 0.06981317007977328,
        "newton_gravity": (
            41870.48375710344,
            {
                "A": (-11939.080703518986, 1907.4131092811697),
                "B": (11936.926048692672, -1867.6379720066623),
                "C": (11546.995535894934, -4081.2253537367797),
                "D": (512.0658414621988, 436.9987463656943),
                "E": (686.5255853157194, 125.89595954534919),
                "F": (-1456.5515585705782, 644.3791878252257),
                "G": (9272.282534343016, -3963.7276411365815),
            },
        ),
        "newton_no_gravity": (
            42124.03664067118,
            {
                "A": (-12037.398378059183, 1782.2904146268863),
                "B": (12035.243723232868, -1791.565277352379),
                "C": (11595.65707412695, -4150.962980789784),
                "D": (561.7219777703781, 484.7090680729817),
                "E": (736.1817216238987, 124.55628125263664),
                "F": (-1406.8954222623988, 544.9395095325132),
                "G": (9370.600208883212, -4181.9549464822985),
            },
        ),
        "speed": -1.0471975511965976,
    },
    {
        "angle": -0.06981317007977306,
        "newton_gravity": (
            -13880.732486662853,
            {
                "A": (3419.106425841128, -2217.2573069320315),
                "B": (-3422.530923121273, 2257.4225765266915),
                "C": (-5936.498471907723, 1743.531837371844),
                "D": (2501.718855048979, 479.1182157036992),
                "E": (2426.218590637707, -180.86477669507445),
                "F": (2135.901855529448, -1418.4243880942004),
                "G": (-3900.8767004888196, 316.1131322884365),
            },
        ),
        "newton_no_gravity": (
            -14873.3084082772,
            {
                "A": (3635.538326309409, -2474.8863492430874),
                "B": (-3638.962823589555, 2466.001618837747),
                "C": (-6330.984811481377, 1818.6501020218248),
                "D": (2679.7732941543513, 514.4789933647742),
                "E": (2604.2730297430794, -194.5539990339995),
                "F": (2313.9562946348196, -1530.2136104331255),
                "G": (-4117.308600957101, 230.39217459949217),
            },
        ),
        "speed": -1.0471975511965976,
    },
]


def watt(gravity: complex) -> Mechanism:
    links = {
        name: Link(
            {j: JOINTS[j] - JOINTS[joints[0]] for j in joints}, mass, center - JOINTS[joints[0]], inertia
        )
        for name, (joints, mass, inertia, center) in LINKS.items()
    }
    load = (JOINTS["C"] + JOINTS["F"] + JOINTS["G"]) / 3 - JOINTS["C"]
    return Mechanism(
        {"A": JOINTS["A"], "G": JOINTS["G"]},
        links,
        inputs=Input(link="AB"),
        guess=Guess(at=(0.0,), angles=dict.fromkeys(links, 0.0)),
        gravity=gravity,
        forces=[Force("CFG", load, 50 + 25j)],
    )


@pytest.mark.parametrize(("case", "gravity"), [("newton_no_gravity", 0j), ("newton_gravity", -9.81j)])
def test_watt_six_bar(case: str, gravity: complex) -> None:
    for pose in POSES:
        motion = watt(gravity).motion(pose["angle"], pose["speed"], 0.0)
        torque, reactions = pose[case]
        # the published poses near the dead position hold some 1e-12 of the conditioned value
        assert motion.effort[0] == pytest.approx(torque, rel=1e-12)
        assert motion.dynamics.newton_euler[0, 0] == pytest.approx(torque, rel=1e-12)
        size = max(np.hypot(*force) for force in reactions.values())
        for joint, force in reactions.items():
            assert np.abs(motion.reaction(joint, ON[joint])[0] - force).max() <= 1e-12 * size
