"""Cams with followers: positions and rates by the law, forces by two ways, mirror images, moving carriers."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from virtualwork import Cam, Guide, Input, Link, Mechanism, Segment, Spring
from virtualwork.formulas.kinematics import CurvatureRadius, PressureAngle, Slide

RNG = np.random.default_rng
MOTIONS = ["simple harmonic", "cycloidal", "3-4-5", "4-5-6-7", "modified sine", "modified trapezoid"]


def law(rng: np.random.Generator, rise: float) -> tuple[Segment, ...]:
    """A rise, a dwell, a return and a dwell."""
    first, second = rng.choice(MOTIONS, 2)
    a, b, c = np.sort(rng.uniform(0.8, 5.6, 3))
    return (
        Segment(0.2, 0.2 + a, rise, str(first)),
        Segment(end=0.2 + b),
        Segment(end=0.2 + c, motion=str(second)),
        Segment(),
    )


def sliding(rng: np.random.Generator, face: str, carried: bool = False, **more: Any) -> Mechanism:
    """A cam and a slider away from it, offset, in a random direction; `carried`: both on an arm that turns."""
    axis = complex(*rng.uniform(-0.05, 0.05, 2))
    angle, on = float(rng.uniform(-3, 3)), "carrier" if carried else "ground"
    body = {"O": axis, "G": axis + 0.01 * complex(*rng.uniform(-1, 1, 2))}
    links = {
        "cam": Link({"O": 0j, "M": 0.02}, 1.2, complex(0.004, 0.002), 0.002),
        "follower": Link({"F": 0j, "E": 0.05 + 0.01j}, 0.4, 0.03 + 0.002j, 1e-4),
    }
    ground: dict[str, complex] = {"S": 0.3 + 0.2j}
    inputs = [Input("cam", on=on, value=0.3, speed=7.0, acceleration=-11.0)]
    if carried:
        links["carrier"] = Link({**body, "C": 0.1j}, 0.8, 0.01j, 0.001)
        ground["C"] = 0j
        inputs.append(Input("carrier", value=0.4, speed=3.0, acceleration=5.0))
    else:
        ground |= body
    cam = Cam(
        "cam",
        0.05,
        slider="F",
        face=face,
        roller_radius=0.012 if face == "roller" else None,
        law=law(rng, 0.02),
    )
    return Mechanism(
        ground,
        links,
        [Guide("F", "follower", on, "G", angle, turned=0.3)],
        inputs=inputs,
        cams=[replace(cam, **more)],
        springs=[Spring((("follower", "E"), ("ground", "S")), 300.0, 0.6, 2.0)],
        gravity=-9.81j,
    )


def swinging(rng: np.random.Generator, face: str, sense: str, **more: Any) -> Mechanism:
    """A cam and an arm on a pivot."""
    pivot = 0.16 * np.exp(1j * rng.uniform(-3, 3))
    links = {
        "cam": Link({"O": 0j}, 1.2, complex(0.004, 0.002), 0.002),
        "arm": Link({"P": 0.01j, "T": 0.13 + 0.005j, "E": 0.2}, 0.4, 0.1 + 0.002j, 1e-3),
    }
    cam = Cam(
        "cam",
        0.05,
        follower="arm",
        point="T",
        sense=sense,
        face=face,
        roller_radius=0.012 if face == "roller" else None,
        law=law(rng, 0.15),
    )
    return Mechanism(
        {"O": 0j, "P": complex(pivot), "S": 0.3 + 0.2j},
        links,
        inputs=Input("cam", value=0.3, speed=7.0, acceleration=-11.0),
        cams=[replace(cam, **more)],
        springs=[Spring((("arm", "E"), ("ground", "S")), 300.0, 0.6, 2.0)],
        gravity=-9.81j,
    )


FACES = ["knife", "roller", "flat"]
Q = np.linspace(0.05, 6.25, 41)


@pytest.mark.parametrize("face", FACES)
def test_the_slide_is_the_law(face: str) -> None:
    m = sliding(RNG(1), face)
    motion = m.motion(Q)
    drive, guide = m.cam_drives[0], m.guides[0]
    from virtualwork.formulas.lifts import lift_at

    slide = motion.slide("F")
    assert np.allclose(slide.position, drive.rest + lift_at(drive.lift, Q), rtol=0, atol=1e-15)
    first, second = (lift_at(drive.lift, Q, k) for k in (1, 2))
    assert np.allclose(slide.speed, 7 * first, rtol=1e-13, atol=1e-15)
    assert np.allclose(slide.acceleration, 49 * second - 11 * first, rtol=1e-12, atol=1e-13)
    # at lift zero the trace point stands on the prime circle, a flat face touches the base circle
    axis, start = m.ground["O"], m.through(guide)
    trace = start + drive.rest * np.exp(1j * guide.angle) - axis
    distance = (trace * np.exp(-1j * guide.angle)).real if face == "flat" else abs(trace)
    assert distance == pytest.approx(m.cams[0].prime_radius, rel=1e-14)


@pytest.mark.parametrize("sense", ["ccw", "cw"])
@pytest.mark.parametrize("face", FACES)
def test_the_arm_touches_the_base_circle(face: str, sense: str) -> None:
    m = swinging(RNG(2), face, sense)
    low = m.motion(np.array([0.1]))  # in the last dwell
    if face == "flat":
        arm = np.exp(1j * low.link("arm").angle)
        off = (low.point("T").position @ [1, 1j]) * arm.conj()
        # the cam lies on the side away from which the arm rises
        assert off.imag == pytest.approx(0.05 * (1 if sense == "ccw" else -1), rel=1e-13)
    else:
        assert np.hypot(*low.point("T").position[0]) == pytest.approx(m.cams[0].prime_radius, rel=1e-13)
    motion = m.motion(Q)
    turned = motion.link("arm").angle - low.link("arm").angle
    turned = np.angle(np.exp(1j * turned))
    assert turned.max() * (1 if sense == "ccw" else -1) <= 0.15 + 1e-12
    assert np.abs(turned).max() == pytest.approx(0.15, rel=1e-2)


def both_ways(m: Mechanism, q: np.ndarray[Any, Any]) -> tuple[Any, Any]:
    """The efforts by virtual work and by Newton and Euler."""
    motion = m.motion(q)
    return motion.effort, np.squeeze(motion.dynamics.newton_euler)


CASES = [
    *((f"slide {face}", lambda rng, face=face: sliding(rng, face)) for face in FACES),
    *(
        (f"arm {face} {sense}", lambda rng, face=face, sense=sense: swinging(rng, face, sense))
        for face in FACES
        for sense in ("ccw", "cw")
    ),
]


@pytest.mark.parametrize(("name", "make"), CASES)
def test_contact_forces_agree_with_virtual_work(name: str, make: Any) -> None:
    for seed in range(5):
        virtual, newton = both_ways(make(RNG(seed)), Q)
        assert np.abs(virtual - newton).max() < 1e-12 * np.abs(virtual).max(), (name, seed)


@pytest.mark.parametrize("face", FACES)
def test_on_a_body_that_turns(face: str) -> None:
    m = sliding(RNG(3), face, carried=True)
    q = np.stack([Q, 0.4 + 0.3 * Q], axis=1)
    virtual, newton = both_ways(m, q)
    assert np.abs(virtual - newton).max() < 1e-12 * np.abs(virtual).max()


@pytest.mark.parametrize(("name", "make"), CASES)
def test_energy_stays(name: str, make: Any) -> None:
    m = make(RNG(0))
    m = replace(m, springs=[replace(m.springs[0], damping=0.0)])
    run = m.simulate(np.linspace(0, 0.2, 5), accuracy=1e-10)
    assert np.ptp(run.energy) < 1e-8 * max(1.0, np.abs(run.energy).max()), name
    assert math.isfinite(run.angle[-1, 0])


def profile_of(m: Mechanism, steps: int = 6000) -> tuple[Any, Any]:
    """Finely, the touching points of a profile and its radii of curvature."""
    from virtualwork.formulas.profiles import profile

    points = profile(m, m.cam_drives[0], steps)
    return np.array([p.profile for p in points]), np.array([p.curvature_radius for p in points])


@pytest.mark.parametrize(("name", "make"), CASES)
def test_the_profile_has_its_curvature_and_its_normal(name: str, make: Any) -> None:
    m = make(RNG(1))
    z, radius = profile_of(m)
    # circles through three neighbours, away from the ends of pieces
    a, b, c = z[:-2], z[1:-1], z[2:]
    area = ((b - a).conj() * (c - b)).imag
    with np.errstate(all="ignore"):
        measured = -np.abs(b - a) * np.abs(c - b) * np.abs(c - a) / (2 * area)
    inner = radius[1:-1]
    smooth = np.abs(radius[2:] - radius[:-2]) < 0.002 * np.abs(inner)
    plain = smooth & (np.abs(inner) > 0.005) & (np.abs(inner) < 0.5)
    assert plain.sum() > 1500
    # where a knife's profile or an undercut one turns back its radius has the other sign
    assert np.median(np.abs(measured[plain] / inner[plain] - 1)) < 1e-4, name


@pytest.mark.parametrize(("name", "make"), CASES)
def test_the_profile_turns_with_its_cam_and_touches(name: str, make: Any) -> None:
    """Where the cam stands, the touching point of the profile lies on the face, and the force across the tangent."""
    from virtualwork.formulas.profiles import profile

    m = make(RNG(4))
    points = profile(m, m.cam_drives[0], 400)
    for k in (37, 151, 290):
        p = points[k]
        pose = m.motion(np.array([p.angle]))
        turn = np.exp(1j * pose.link("cam").angle[0])
        axis = m.ground["O"]
        touch = axis + p.profile * turn
        follower = m.cams[0].follower or "follower"
        trace = pose.point(m.cams[0].point or "F").position[0] @ [1, 1j]
        if m.cams[0].face == "roller":
            assert abs(touch - trace) == pytest.approx(0.012, rel=1e-12)
        elif m.cams[0].face == "knife":
            assert abs(touch - trace) < 1e-13
        else:
            face = np.exp(1j * pose.link(follower).angle[0])
            if follower == "follower":
                face = 1j * np.exp(1j * m.guides[0].angle)
            assert abs((face.conjugate() * (touch - trace)).imag) < 1e-13
    # the pitch curve of a roller lies everywhere at its radius from the profile, nearest there
    z = np.array([p.profile for p in profile(m, m.cam_drives[0], 4000)])
    if m.cams[0].face == "roller" and min(p.curvature_radius for p in points) > 0:
        for p in points[::40]:
            # of points 0.2 mm apart one is 0.5 µm farther than the nearest point of the curve
            assert 0.012 - 1e-12 < np.abs(z - p.pitch).min() < 0.012 + 5e-7


def test_pressure_angle_in_closed_form() -> None:
    """Norton's eq. 8.31d: tan φ = (v − ε)/(s + √(R² − ε²)), ε to the right of the follower's way where the cam turns ccw."""
    m = sliding(RNG(7), "roller")
    motion, drive, guide = m.motion(Q), m.cam_drives[0], m.guides[0]
    from virtualwork.formulas.lifts import lift_at

    along = np.exp(1j * guide.angle)
    offset = ((m.ground["O"] - m.through(guide)) * along.conjugate()).imag
    s, v = (lift_at(drive.lift, Q, k) for k in (0, 1))
    high = s + math.sqrt(m.cams[0].prime_radius ** 2 - offset**2)
    (value,) = motion.values([PressureAngle(0)])
    assert np.allclose(value, np.arctan2(v - offset, high), rtol=0, atol=1e-15)


def test_a_step_of_the_law_and_undercut_are_named() -> None:
    from virtualwork.study.cams import check_cam

    m = sliding(RNG(0), "roller")
    quick = (
        Segment(end=0.5, rise=0.04, motion="simple harmonic"),
        Segment(end=3.0),
        Segment(end=5.0, motion="cycloidal"),
        Segment(),
    )
    m = replace(m, cams=[replace(m.cams[0], law=quick)])
    found = check_cam(m, 0)
    assert [(order, round(angle, 9)) for order, angle in found.steps] == [(2, 0.0), (2, 0.5)]
    assert found.undercut
    assert len(found.warnings) == 2
    assert not check_cam(sliding(RNG(0), "knife"), 0).undercut


WRONG = [
    ({"law": ()}, "found no segment"),
    ({"law": (Segment(end=1.0, rise=0.01, motion="3-4-5"), Segment(2.0))}, "where the segment before ends"),
    ({"law": (Segment(end=1.0, rise=0.01, motion="3-4-5"), Segment())}, "at the end of the turn"),
    ({"law": (Segment(end=7.0),)}, "expected a turn"),
    ({"law": (Segment(rise=0.01),)}, "a dwell does not move"),
    ({"law": (Segment(end=1.0, motion="3-4-5"), Segment(motion="3-4-5"))}, "only one segment"),
    ({"law": (Segment(motion="345"),)}, "expected 'dwell' or"),
    ({"base_radius": 0.0}, "above zero"),
    ({"roller_radius": None}, "missing"),
    ({"face": "knife"}, "expected none"),
    ({"cam": "follower"}, "expected a follower of its own"),
    ({"slider": None}, "either a slider or a follower"),
    ({"base_radius": 1e-6, "face": "knife", "roller_radius": None}, "less than the prime radius"),
    ({"law": None}, "either a law or a table"),
    ({"law": (Segment(end=2.0, rise=-0.09, motion="3-4-5"), Segment(motion="3-4-5"))}, "pass the cam's axis"),
]


@pytest.mark.parametrize(("change", "words"), WRONG)
def test_what_no_cam_can_be(change: dict[str, Any], words: str) -> None:
    from virtualwork import DescriptionError

    m = sliding(RNG(5), "roller")
    with pytest.raises(DescriptionError, match=words) as caught:
        replace(m, cams=[replace(m.cams[0], **change)])
    assert "\n" not in str(caught.value)


def test_a_follower_cannot_drive_its_cam() -> None:
    from virtualwork import MobilityError

    m = sliding(RNG(5), "roller")
    with pytest.raises(MobilityError, match="drive the cam"):
        replace(m, inputs=[Input(slider="F", value=0.06)]).motion(np.array([0.06]))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_digits_hold_against_fifty(seed: int) -> None:
    """Slide, speed and acceleration of a file's decimals: no error is above its estimate."""
    import mpmath as mp

    from tests.virtualwork.test_cam_laws import TRUTH

    rng = RNG(seed)
    motion = MOTIONS[seed % 6]
    a, b, c = (round(float(rng.uniform(*span)), 1) for span in ((0, 40), (60, 150), (160, 300)))
    rise, radius = (round(float(rng.uniform(*span)), 2) for span in ((1, 30), (20, 60)))
    m = Mechanism.from_toml_text(f"""
        units = {{ length = "mm", angle = "deg" }}
        ground = {{ O = [0, 0] }}
        links = {{ cam = {{ points = {{ O = [0, 0] }} }}, rod = {{ points = {{ F = [0, 0] }} }} }}
        sliders = [{{ point = "F", angle = 90, turned = -90 }}]
        input = {{ link = "cam", speed = 7.3, acceleration = 0 }}
        [[cams]]
        cam = "cam"
        slider = "F"
        base_radius = {radius}
        law = [{{ from = {a}, to = {b}, rise = {rise}, motion = "{motion}" }}, {{ to = {c}, motion = "dwell" }},
               {{ motion = "3-4-5" }}]
        """)
    q = rng.uniform(math.radians(a), math.radians(b), 6)
    made = m.motion(q)
    with mp.workdps(50):
        low, high = mp.mpf(str(a)) * mp.pi / 180, mp.mpf(str(b)) * mp.pi / 180
        for k in range(3):
            key = Slide(0, k)
            (values,), estimates = made.values([key]), made.rounding.of(key)
            for x, value, estimate in zip(q, values, estimates, strict=True):
                u = (mp.mpf(float(x)) - low) / (high - low)
                law = mp.diff(TRUTH[motion], u, k) if k else TRUTH[motion](u)
                true = law * mp.mpf(str(rise)) / 1000 * (mp.mpf("7.3") / (high - low)) ** k
                true += mp.mpf(str(radius)) / 1000 if k == 0 else 0
                assert abs(mp.mpf(float(value)) - true) <= estimate, (motion, k, x)


PATHS = ["cams.1.base_radius", "cams.1.law.1.rise", "cams.1.law.1.to", "cams.1.law.3.to", "ground.O.x"]


@pytest.mark.parametrize("face", FACES)
def test_dimensions_of_a_cam_vary(face: str) -> None:
    """Sensitivities against differences, variants against the mechanism made anew."""
    from virtualwork.describe.dimensions import changed, value

    m = sliding(RNG(8), face)
    motion = m.motion(Q)
    for path in PATHS:
        own, step = value(m, path), 1e-6
        up, down = (changed(m, {path: own + side * step}).motion(Q).effort for side in (1, -1))
        slope = motion.sensitivity("effort", path)
        assert np.abs(slope - (up - down) / (2 * step)).max() < 1e-6 * np.abs(slope).max(), path
    radii = np.linspace(0.04, 0.06, 5)
    family = m.vary({"cams.1.base_radius": radii}).motion(Q)
    for i, radius in enumerate(radii):
        alone = changed(m, {"cams.1.base_radius": float(radius)}).motion(Q)
        assert np.abs(family.effort[i] - alone.effort).max() < 1e-14 * np.abs(alone.effort).max()


def test_a_flat_faced_cam_of_harmonic_motion_is_a_circle() -> None:
    """Out and back in one turn, 50 mm over a base circle of 25 mm: an eccentric circle of 50 mm, the face 50 mm long."""
    from virtualwork.formulas.profiles import profile

    half = Segment(end=math.pi, rise=0.05, motion="simple harmonic")
    cam = Cam("cam", 0.025, slider="F", face="flat", law=(half, Segment(motion="simple harmonic")))
    m = Mechanism(
        {"O": 0j},
        {"cam": Link({"O": 0j}), "rod": Link({"F": 0j})},
        [Guide("F", "rod", turned=0.0)],
        inputs=Input("cam", value=0.0),
        cams=[cam],
    )
    points = profile(m, m.cam_drives[0])
    assert max(abs(abs(p.profile + 0.025) - 0.05) for p in points) < 1e-16 * 3
    offsets = [p.offset for p in points]
    assert max(offsets) - min(offsets) == pytest.approx(0.05, rel=1e-4)


@pytest.mark.parametrize(("name", "make"), CASES)
def test_every_link_is_in_balance(name: str, make: Any) -> None:
    """Cut loose, with the contact force at the profile, ΣF and ΣM of each link vanish."""
    from virtualwork.study.free_bodies import free_bodies

    motion = make(RNG(6)).motion(Q)
    for body in free_bodies(motion.dynamics):
        largest = max(np.abs(force.force).max() for force in body.forces)
        force, moment = body.resultant()
        assert np.abs(force).max() < 1e-13 * largest, (name, body.link)
        assert np.abs(moment).max() < 1e-13 * largest, (name, body.link)


@pytest.mark.parametrize(("face", "roller"), [("knife", None), ("roller", 0.01)])
@pytest.mark.parametrize("sense", [1, -1])
def test_a_profile_that_is_straight_at_a_point(face: str, roller: float | None, sense: int) -> None:
    """A rise of 25 mm in 90° by simple harmonic motion begins with h″ = h/2·(π/β)² = 50 mm: the pitch radius of 50 mm is undone."""
    m = Mechanism(
        {"O": 0j},
        {"cam": Link({"O": 0j}), "rod": Link({"F": 0j})},
        [Guide("F", "rod", angle=sense * math.pi / 2, turned=0.0)],
        inputs=Input("cam", value=0.0),
        cams=[
            Cam(
                "cam",
                0.05 - (roller or 0.0),
                slider="F",
                face=face,
                roller_radius=roller,
                law=(
                    Segment(end=math.pi / 2, rise=0.025, motion="simple harmonic"),
                    Segment(motion="3-4-5"),
                ),
            )
        ],
    )
    (found,) = m.check.cams
    assert not found.undercut
    assert 0 < found.curvature_radius < 0.06
    for at in ([0.0], [0.0, 0.1]):
        radius = m.motion(np.array(at)).value(CurvatureRadius(0))
        assert not np.isfinite(radius[0])
        assert np.isfinite(radius[1:]).all()
