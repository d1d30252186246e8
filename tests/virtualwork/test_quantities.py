"""The classes of quantities: keys that are never equal across kinds, by their old names on tapes."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from mpmath import mp

from virtualwork import Guess, Guide, Input, Link, Mechanism, TorsionSpring
from virtualwork.digits.exact import Gap
from virtualwork.evaluator import key_of
from virtualwork.family.design import numbers_of
from virtualwork.family.part import Assembled
from virtualwork.formulas.forces import Effort, Force, JointForce, NewtonEuler, Over, Reaction, Rub, Shaking
from virtualwork.formulas.kinematics import Angle, AnglePartial, Point, PointPartial, Slide, Turn
from virtualwork.formulas.loops import Closed, Margin, Size
from virtualwork.formulas.quantity import NOTHING, Quantity
from virtualwork.quantities import slides


def kinds(of: type[Quantity] = Quantity) -> set[type[Quantity]]:
    """Every class below one that has a kind; that of the docstring of the base is none."""
    below = {kind for each in of.__subclasses__() for kind in (each, *kinds(each))}
    return {kind for kind in below if kind.kind and kind.__module__ != Quantity.__module__}


def test_every_kind_has_its_own_name_and_formula() -> None:
    every = kinds()
    assert {Gap, Rub, Over, Assembled, Point, Effort, Closed} <= every
    assert len({kind.kind for kind in every}) == len(every)
    for kind in every:
        # whether a pose is assembled is no number of the tape
        assert kind.write is not Quantity.write or kind is Assembled
        # a force has a formula over one pose, or writes its own on the tape
        own = kind.__dict__.get("write") or getattr(kind, "form", None) is not Force.form
        assert not issubclass(kind, Force) or own


@pytest.mark.parametrize(
    ("quantity", "names"),
    [
        (
            Point("coupler", 0.5 - 1j, "H", 2),
            ("point coupler (0.5-1j) H 2 x", "point coupler (0.5-1j) H 2 y"),
        ),
        (PointPartial("bar", 0j, None, 0, 1), ("dpoint bar 0j None 0 1 x", "dpoint bar 0j None 0 1 y")),
        (Angle("crank", 1), ("angle crank 1",)),
        (Turn("crank"), ("turn crank x", "turn crank y")),
        (Slide(0, 2), ("slide 0 2",)),
        (NewtonEuler(1), ("newton-euler 1",)),
        (JointForce("pin:B", "coupler"), ("force pin:B coupler x", "force pin:B coupler y")),
        (Shaking(), ("shaking x", "shaking y")),
        (Closed(("A", "B C")), ("closed A B C",)),
        (Closed(()), ("closed",)),
        (Size(), ("size",)),
    ],
)
def test_names_on_tapes(quantity: Quantity, names: tuple[str, ...]) -> None:
    assert quantity.names == names
    assert pickle.loads(pickle.dumps(quantity)) == quantity
    assert type(pickle.loads(pickle.dumps(quantity))) is type(quantity)


def test_equal_fields_of_two_kinds_are_two_keys() -> None:
    alike = [Effort(0), NewtonEuler(0), Margin("0"), Turn("0"), Angle("B", 0), AnglePartial("B", 0, 0)]
    alike += [JointForce("B", "bar"), Reaction("B", "bar")]
    assert len(dict.fromkeys(alike)) == len(alike)
    assert {Effort(0): 1}[Effort(0)] == 1


def test_fields_orders_and_what_is_nothing() -> None:
    point = Point("coupler", 1j, "H", 2)
    assert (point.body, point.z, point.node, point.order) == ("coupler", 1j, "H", 2)
    assert point.of_order(0) == Point("coupler", 1j, "H", 0)
    assert type(point.of_order(0)) is Point
    assert (Angle("crank", 0).is_angle, Angle("crank", 1).is_angle, Slide(0, 0).is_angle) == (
        True,
        False,
        False,
    )
    assert Shaking()
    assert not NOTHING
    with pytest.raises(AttributeError):
        point.order = 1  # type: ignore[misc]
    with pytest.raises(TypeError):
        Angle("crank")  # type: ignore[call-arg]


def test_the_error_of_what_acts_on_a_link() -> None:
    """The torque of a torsion spring, against itself in fifty digits."""
    arm = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "P": 1})},
        inputs=Input(link="arm"),
        torsion_springs=[TorsionSpring(("ground", "arm"), 0.3, 0.1)],
    )
    q = np.linspace(0.2, 1.3, 7)
    motion = arm.motion(q)
    _, torque = motion.applied("arm")
    force_error, error = motion.dynamics.error_estimate().applied("arm")
    with mp.workdps(50):
        true = [-mp.mpf(0.3) * (mp.mpf(x) - mp.mpf(0.1)) for x in q.tolist()]
        off = np.array([float(abs(mp.mpf(x) - y)) for x, y in zip(torque.tolist(), true, strict=True)])
    assert (force_error == 0).all()
    assert (off <= 1.0001 * error + 1e-30).all()
    assert (error <= 4 * np.spacing(np.abs(torque))).all()


def test_a_point_in_two_guides_has_its_place_in_the_first() -> None:
    ground = {"O": 0j, "C": 0.15 - 0.2j}
    links = {"crank": Link({"O": 0j, "A": 0.05}), "rod": Link({"A": 0j, "B": 0.2}), "lever": Link({"C": 0j})}
    guides = [Guide("B", "rod"), Guide("B", "rod", on="lever", through="C", angle=np.pi / 2)]
    guess = Guess(1.0, {"rod": -0.2, "lever": 0.0})
    m = Mechanism(ground, links, guides, inputs=Input("crank"), guess=guess)
    np.testing.assert_allclose(m.motion(0.0).slide("B").position, 0.25)
    assert [each.key for each in slides(m, ["B"], 0)] == [Slide(0, 0)]
    assert key_of(m.assembly, "slides.B") == Slide(0, 0)
    assert numbers_of(m, "slides.B") == (Slide(0, 0),)
