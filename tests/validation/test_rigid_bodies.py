"""Published and worked cases of rigid bodies in space, each named after its source, through the command line.

The numbers are the sources' own, or exact ones that follow from their data; printed digits are held to their
last place.
"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from rigidbody3d import (
    Body,
    FreeBody,
    Motion,
    Top,
    check,
    compose,
    cones,
    gyroscopic_couple,
    inertia_of,
    mesh,
    steady_precession,
)
from rigidbody3d.attitude import angle_between


@pytest.fixture
def body(dalembert, tmp_path):
    def run(parts: str, *options: object) -> dict:
        (tmp_path / "parts.csv").write_text(parts)
        done = dalembert("body", "parts.csv", *options, "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


@pytest.fixture
def spin(dalembert, tmp_path):
    def run(toml: str, *options: object) -> dict:
        (tmp_path / "body.toml").write_text(toml)
        done = dalembert("spin", "body.toml", *options, "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


def close(found, wanted, rtol: float = 1e-12) -> None:
    """Compare vectors by their largest component."""
    wanted = np.asarray(wanted, dtype=float)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=rtol * np.abs(wanted).max(initial=1e-300))


@pytest.mark.parametrize("radius", [0.1015, 0.1016, 0.1524, 0.203])
def test_riul_example_3_disk_on_a_turning_arm(body, radius: float) -> None:
    # the radius is lost in the scan: H_A = m r² (ω1/4 j + ω2/2 k), Ḣ_A = m r² ω1 ω2/2 i
    m, w1, w2 = 3.63, 4.0, 12.0
    found = body(
        f"part,shape,mass_kg,radius_m,x_m\ndisk,disk,{m},{radius},0.406\n",
        *("--omega", "0,4,12", "--frame-omega", "0,4,0", "--about", "0,0,0"),
        *("--velocity", "0,0,-1.624", "--acceleration", "-6.496,0,0"),
    )
    H = m * radius**2 * np.array([0, w1 / 4, w2 / 2])
    close(found["momentum_kg_m2_s"], H)
    close(found["momentum_rate_N_m"], [m * radius**2 * w1 * w2 / 2, 0, 0])
    close(found["momentum_about_kg_m2_s"], H + [0, m * w1 * 0.406**2, 0])
    close(found["inertia_force_N"], [23.58048, 0, 0])
    close(found["rate_terms_N_m"]["relative"], [0, 0, 0])


@pytest.mark.parametrize(
    ("m", "b", "beta", "omega", "couple"),
    [
        (4.0, 0.5, 30.0, 10.0, 14.433756729740644),
        (2.0, 0.3, 60.0, 50.0, 64.9519052838329),
        (1.0, 1.0, 0.001, 1.0, 5.81776417213297e-06),
    ],
)
def test_riul_example_4_rod_welded_obliquely(body, m, b, beta, omega, couple) -> None:
    # β from the horizontal; M = -(1/6) m b² ω² sin 2β, and equal and opposite forces of the bearings
    found = body(
        f"part,shape,mass_kg,length_m,axis_x,axis_z,ry_deg\nrod,rod,{m},{2 * b},1,0,{-beta}\n",
        *("--shaft", f"{-b}:{b}".replace(":", "m:") + "m", "--speed", f"{omega}rad_s"),
    )
    close(found["momentum_rate_N_m"], [0, -couple, 0])
    forces = np.array([bearing["dynamic_N"] for bearing in found["shaft"]["bearings"]])
    close(forces, [[couple / (2 * b), 0], [-couple / (2 * b), 0]])
    assert found["shaft"]["drive_torque_N_m"] == 0


def test_riul_example_4_in_its_own_axes() -> None:
    # shaft along y, rod in the plane x y: m = 3, b = 0.4, ω = 10, β = 35°
    beta = math.radians(35)
    u = np.array([math.cos(beta), -math.sin(beta), 0])
    I = 3 * 0.4**2 / 3 * (np.eye(3) - np.outer(u, u))
    rod = Motion(I, [0, 10.0, 0])
    close(rod.momentum, [0.7517540966287267, 1.073616114660535, 0])
    close(rod.rate, [0, 0, -7.517540966287267])


def test_riul_example_4_by_integration_over_the_rod(body) -> None:
    # the same rod as 20 point masses at the nodes of Gauss, which integrate x z exactly
    nodes, weights = np.polynomial.legendre.leggauss(20)
    c, s = math.cos(math.radians(60)), math.sin(math.radians(60))
    rows = "".join(
        f"p{i},point,{4 * w / 2!r},{0.5 * x * s!r},{0.5 * x * c!r}\n"
        for i, (x, w) in enumerate(zip(nodes.tolist(), weights.tolist(), strict=True))
    )
    found = body("part,shape,mass_kg,x_m,z_m\n" + rows, "--shaft=-0.5m:0.5m", "--speed", "10rad_s")
    close(found["momentum_rate_N_m"], [0, -14.433756729740644, 0])


def test_beer_18_1_disk_in_a_fork(body) -> None:
    found = body("part,shape,mass_kg,radius_m\nd,disk,1,1\n", "--omega", "0,2,3")
    close(found["momentum_kg_m2_s"], [0, 0.5, 1.5])


def test_beer_18_6_prism_about_its_diagonal(body) -> None:
    found = body(
        "part,shape,mass_kg,width_m,height_m,depth_m\nb,box,1,1,1,2\n",
        *("--omega", ",".join(repr(x / math.sqrt(6)) for x in (1, 1, 2))),
    )
    H = np.array(found["momentum_kg_m2_s"])
    assert np.linalg.norm(H) == pytest.approx(math.sqrt(11) / 12, rel=1e-14)
    angle = math.degrees(math.acos(H @ [1, 1, 2] / math.sqrt(6) / np.linalg.norm(H)))
    assert round(angle, 1) == 25.2


def test_beer_sample_18_3_rod_on_a_wire(body) -> None:
    # 40 lb, 8 ft, 60° above the horizontal, turning at 15 rad/s about the vertical through A; g = 32.2 ft/s²
    m, L, beta, w = 40 / 32.2, 8.0, math.radians(60), 15.0
    rise, run_ = L / 2 * math.sin(beta), L / 2 * math.cos(beta)
    # any units that agree will do: slug, ft, lb; the shaft along y of the book is z here
    found = body(
        f"part,shape,mass_kg,length_m,axis_x,axis_z,x_m,z_m\nr,rod,{m!r},{L},{math.cos(beta)!r},{math.sin(beta)!r},{run_!r},{rise!r}\n",
        *("--omega", f"0,0,{w}", "--fixed", "0,0,0"),
    )
    moment = found["momentum_rate_about_N_m"][1]
    wire = (40 * run_ - moment) / (2 * rise)
    assert wire == pytest.approx(384.21781283720884, rel=1e-12)
    assert wire - found["inertia_force_N"][0] == pytest.approx(-174.78839834291557, rel=1e-12)


def test_beer_18_81_engine_in_a_curve() -> None:
    r, t = 0.2, 0.015
    m = 7860 * math.pi * r**2 * t
    I = inertia_of("cylinder", m, radius=r, length=t)[2, 2]
    assert abs(I - 0.29632) < 2e-5 * I
    couple = gyroscopic_couple([0, I * 2700 * math.pi / 30, 0], [0, 0, 25 / 200])
    assert np.linalg.norm(couple) == pytest.approx(10.472637229995918, rel=1e-12)


def test_khurmi_14_1_disk_precessing_under_its_weight() -> None:
    I = inertia_of("disk", 5.0, radius=0.15)[2, 2]
    found = steady_precession(0.0, I, 5 * 9.81 * 0.6, math.pi / 2, 300 * math.pi / 30)
    assert found.slow == pytest.approx(16.653973245135926, rel=1e-12)


def test_meriam_sample_7_6_bent_plate(body) -> None:
    found = body(
        "part,shape,area_density_kg_m2,width_m,height_m,x_m,y_m,z_m,rx_deg,ry_deg\n"
        "A,plate,70,0.1,0.125,0,0.0625,0.05,0,90\n"
        "B,plate,70,0.075,0.15,0.0375,0.125,0.075,90,0\n",
        *("--omega", "0,0,30", "--fixed", "0,0,0"),
    )
    close(found["momentum_about_kg_m2_s"], [-0.0664453125, -0.303515625, 0.55015625])
    assert found["energy_J"] == pytest.approx(8.25234375, rel=1e-12)


def test_meriam_7_53_products_of_inertia_turn_the_momentum(body) -> None:
    # H = (-I_xz, -I_yz, I_zz) ω: a sign that no definiteness test can see
    found = body(
        "part,shape,mass_kg,ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixz_kg_m2,iyz_kg_m2\nt,tensor,1,6,6,2,1,2\n",
        *("--omega", "0,0,-30"),
    )
    close(found["momentum_kg_m2_s"], [30, 60, -60])
    assert np.linalg.norm(found["momentum_kg_m2_s"]) == pytest.approx(90, rel=1e-14)


def test_swash_plate(body) -> None:
    found = body(
        "part,shape,mass_kg,radius_m,ry_deg\nd,disk,8,0.25,12\n", "--shaft", "-1m:1m", "--speed", "100rad_s"
    )
    assert abs(found["momentum_rate_N_m"][1]) == pytest.approx(254.21040192237513, rel=1e-12)


MASSES = [
    0.6599613064970464,
    0.9900641329136964,
    0.29377782841203903,
    0.2441908304720601,
    0.6512856438457277,
    0.13954780716524504,
]
POINTS = [
    [0.00012301533574825743, 0.02987455375084699, 0.4177586433913347],
    [-0.08905918387572742, -0.04546707851717226, 0.20250603350106128],
    [0.006014360259743849, 0.13402152455545335, 0.35233804443460115],
    [-0.062047489981994046, 0.04898420501851983, 0.6070661024480182],
    [0.010541424899789856, -0.09304680447082048, 0.49122445326101793],
    [0.06953031944582878, -0.1344214547285082, 0.36271527168793455],
]


def test_two_plane_corrections_from_products_of_inertia(body) -> None:
    rows = "".join(f"p,point,{m!r},{x!r},{y!r},{z!r}\n" for m, (x, y, z) in zip(MASSES, POINTS, strict=True))
    found = body(
        "part,shape,mass_kg,x_m,y_m,z_m\n" + rows,
        *("--shaft", "0m:1m", "--speed", "50rad_s", "--correct", "A:0.1m:50mm", "--correct", "B:0.9m:50mm"),
    )["shaft"]
    made = [
        c["unbalance_kg_m"]
        * np.array([math.cos(math.radians(c["angle_deg"])), math.sin(math.radians(c["angle_deg"]))])
        for c in found["corrections"]
    ]
    close(made, [[0.07114124583343533, 0.03959196077074916], [0.013768132564727907, 0.013731534426082284]])
    before = max(np.linalg.norm(b["dynamic_N"]) for b in found["bearings"])
    for bearing in found["bearings"]:
        assert np.linalg.norm(bearing["corrected_dynamic_N"]) <= 1e-13 * before


@pytest.mark.parametrize(
    ("source", "tensor", "valid", "margin"),
    [
        ("basilisk 1527", np.diag([1, 1, 3]), False, -1.0),
        ("basilisk 1527, flat", np.diag([1, 2, 3]), True, 0.0),
        ("basilisk 1527, rod", np.diag([0, 1, 1]), True, 0.0),
        (
            "TALOS, example-robot-data 130",
            [[1.15e-4, 5.2e-5, 2.5e-5], [5.2e-5, 1.53e-4, 3.4e-5], [2.5e-5, 3.4e-5, 1.9e-4]],
            False,
            -5.751397170165455e-06,
        ),
        ("MIA hand, mujoco 375", np.diag([1.486e-06, 2e-07, 8.31e-07]), False, -4.55e-07),
        ("gazebo_models 33", np.diag([1.11, 100.11, 1.01]), False, -97.99),
    ],
)
def test_validity_of_published_tensors(source, tensor, valid, margin) -> None:
    verdict = check(tensor)
    assert bool(verdict.valid) is valid, source
    assert verdict.margin == pytest.approx(margin, rel=1e-9, abs=1e-15)
    assert bool(verdict.reason) is not valid


def test_landau_32_7_cone_rolling_on_a_plane() -> None:
    # T = 3 m h² V-dot² (1 + 5 cos² a)/40, with the cone's axis turning at Ω; the apex is at rest
    m, h, r, rate = 2.5, 0.3, 0.12, 3.0
    a = math.atan2(r, h)
    cone = Body.of("cone", m, radius=r, length=h)
    # instantaneous axis: the line of contact; ω = Ω cot a. In the cone's axes it lies at angle a from -z
    w = rate / math.tan(a)
    state = Motion.about_fixed_point(
        cone.inertia, [w * math.sin(a), 0, w * math.cos(a)], mass=m, center=[0, 0, 0.75 * h]
    )
    assert state.energy == pytest.approx(0.806508620689655, rel=1e-12)


def test_curtis_10_2_precession_of_a_shell() -> None:
    axial = 100.0
    across = 50.0 + 100 * 9 / 12
    theta = math.radians(20)
    spin = 2 * math.pi  # a minute, relative to the precessing plane: ω3 (I1 - I3)/I1
    w3 = spin * across / (across - axial)
    found = cones(across, axial, [axial * w3 * math.tan(theta) / across, 0, w3])
    assert found.precession == pytest.approx(26.745704576991006, rel=1e-12)
    assert math.pi / found.precession * 60 == pytest.approx(7.047694655894313, rel=1e-12)


FREE = {
    "generic": (
        [1.0, 2.0, 3.0],
        [1.0, 0.1, 0.5],
        10.0,
        [0.489305924077645482, 0.56906304234201769871, -0.33593876908651818057, 0.56911519917113742816],
        [0.5596570040211334431, -1.6694718180910859883, -0.435485805107047002],
    ),
    "nearly symmetric": (
        [1.0, 1.0000000001, 2.0],
        [0.6, 0.4 / 1.0000000001, 0.6],
        30.0,
        [0.85875676509948872877, 0.0058685536902472149584, 0.36351246499578957671, 0.3610554891787840978],
        [0.69658492326373762964, -0.18646566616030586566, 1.2000000000104358361],
    ),
}


@pytest.mark.parametrize("case", FREE)
def test_free_rotation_against_fifty_digits(spin, case) -> None:
    inertia, omega, t, q, H = FREE[case]
    toml = f"inertia = {inertia}\nomega = {omega}\nattitude = [0.5, 0.5, 0.5, 0.5]\n"
    state = spin(toml, "--at", t)["states"][0]
    close(np.multiply(inertia, state["omega_rad_s"]), H, 1e-14)
    assert angle_between(state["attitude"], q) < 5e-15


def test_free_rotation_near_the_separatrix_against_fifty_digits() -> None:
    # H = (0.5, 0.3, 0.8660254124446926); ω3 = H3/3 is rounded, and that rounding is all the error there is
    q = FreeBody([1, 2, 3], [0.5, 0.15, 0.8660254124446926 / 3], [0.5] * 4).at(30.0).attitude
    wanted = [
        -0.80171446883754452323,
        0.018766239874105642361,
        0.31098284557318434126,
        0.51008960826184879198,
    ]
    assert angle_between(q, wanted) < 2e-13


def test_landau_37_12_period(spin) -> None:
    found = spin("inertia = [1, 2, 3]\nomega = [1, 0.1, 0.5]\n", "--at", 0)
    assert found["period_s"] == pytest.approx(14.897368369859112, rel=1e-14)


def test_goldstein_fast_top_against_fifty_digits(spin) -> None:
    toml = (
        f"inertia = [0.002, 0.002, 0.0008]\nomega = [0, 0, 100]\nattitude = [{math.cos(0.2)!r}, {math.sin(0.2)!r}, 0, 0]\n"
        "[top]\nmgl = 0.1962\n"
    )
    found = spin(toml, "--at", repr(2 * math.pi))
    wanted = [0.68965604884489621629, -0.21286290237919069305, 0.041763000690095459366, 0.6908833265144791028]
    assert angle_between(found["states"][0]["attitude"], wanted) < 2e-13  # 628 rad of spin
    assert found["drift"]["energy"] < 1e-14


def test_goldstein_5_7_both_rates_of_steady_precession(spin) -> None:
    toml = f"inertia = [0.002, 0.002, 0.0008]\nomega = [0, 0, 60]\nattitude = [{math.cos(0.2)!r}, {math.sin(0.2)!r}, 0, 0]\n[top]\nmgl = 0.1962\n"
    found = spin(toml)["steady"]
    assert found["slow_rad_s"] == pytest.approx(5.076535962183041, rel=1e-13)
    assert found["fast_rad_s"] == pytest.approx(20.98037031901469, rel=1e-13)
    assert found["sleeping_threshold_rad_s"] == pytest.approx(
        2 * math.sqrt(0.1962 * 0.002) / 0.0008, rel=1e-15
    )


def test_a_top_started_at_either_rate_precesses_steadily() -> None:
    for rate in steady_precession(0.002, 0.0008, 0.1962, 0.4, 60.0):
        top = Top(
            [0.002, 0.002, 0.0008],
            0.1962,
            [0, rate * math.sin(0.4), 60.0],
            [math.cos(0.2), math.sin(0.2), 0, 0],
        )
        low, high = top.nutation
        assert high - low < 1e-7
        w, x, y, z = top.at(np.linspace(0, 5, 50)).attitude.T
        np.testing.assert_allclose(w * w + z * z - x * x - y * y, math.cos(0.4), rtol=1e-13)


@pytest.mark.parametrize(
    ("shape", "mass", "dimensions", "diagonal"),
    [
        ("disk", 2.0, {"radius": 0.3}, [0.045, 0.045, 0.09]),
        ("rod", 3.0, {"length": 1.0}, [0.25, 0.25, 0.0]),
        ("cone", 10.0, {"radius": 1.0, "length": 2.0}, [3.0, 3.0, 3.0]),
        ("tube", 12.0, {"radius": 2.0, "inner_radius": 2.0, "length": 6.0}, [60.0, 60.0, 48.0]),
        ("sphere", 5.0, {"radius": 1.0}, [2.0, 2.0, 2.0]),
        ("sphere", 3.0, {"radius": 1.0, "inner_radius": 1.0}, [2.0, 2.0, 2.0]),
    ],
)
def test_tables_of_moments_of_inertia(shape, mass, dimensions, diagonal) -> None:
    np.testing.assert_allclose(inertia_of(shape, mass, **dimensions), np.diag(diagonal), rtol=1e-14)


def test_the_unit_tetrahedron_has_rational_moments() -> None:
    corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    m, c, I = mesh(corner, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], density=6.0)
    np.testing.assert_allclose(c, [0.25] * 3, rtol=1e-14)
    about_corner = Body(m, c, I).about([0, 0, 0])
    np.testing.assert_allclose(about_corner, np.full((3, 3), -0.05) + 0.25 * np.eye(3), rtol=1e-13)


def test_bored_block_as_parts_with_a_negative_mass() -> None:
    # a tube is a cylinder less a cylinder
    outer, inner = (math.pi * r * r * 0.4 * 7800 for r in (0.2, 0.15))
    parts = Body(
        np.array([outer, -inner]),
        np.zeros((2, 3)),
        np.stack(
            [
                inertia_of("cylinder", outer, radius=0.2, length=0.4),
                inertia_of("cylinder", -inner, radius=0.15, length=0.4),
            ]
        ),
    )
    whole = compose(parts)
    np.testing.assert_allclose(
        whole.inertia,
        inertia_of("tube", outer - inner, radius=0.2, inner_radius=0.15, length=0.4),
        rtol=1e-13,
    )
