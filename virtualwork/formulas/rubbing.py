"""Joint friction written down: what each contact's friction would have to be, and which way it slips, are quantities.

Whoever runs the tape exchanges the friction that enters (`friction 0` …, see `pose_forces`) for it until they agree. A further
input of the tape: `slip 0`, which way the first contact slips, ±1.
"""

from __future__ import annotations

from dalembert.arithmetic.recorded import RECORDED, Number, bare
from virtualwork.formulas.forces import Bearing, SlippingRate
from virtualwork.formulas.quantity import Quantity, Recording


class Rub(Quantity, kind="rub"):
    """The friction of a contact by the force that it bears."""

    contact: int

    def write(self, recording: Recording) -> Number:
        joint, *_, coefficient, radius = recording.forces.case.contacts[self.contact]
        slip = recording.recorder.input(f"slip {self.contact}") * bare(coefficient)
        arm = slip * bare(radius) if joint.guide is None else slip
        return -(arm * abs(recording.value(Bearing(self.contact))))


class Slip(Quantity, kind="slip"):
    """Which way a contact slips: ±1, or 0."""

    contact: int

    def write(self, recording: Recording) -> Number:
        rate = recording.value(SlippingRate(self.contact))
        return RECORDED.select(rate, 1.0, RECORDED.select(-rate, -1.0, 0.0))
