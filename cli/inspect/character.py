"""The character of a mechanism: as a table, as JSON, the order of its solution; the worked solution."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from cli.cases.analysis import Analysis
from cli.cases.case import Case, Study
from cli.cases.poses import keys_of, listed
from cli.cases.study import METHOD
from dalembert.angles import in_turn
from dalembert.dataclass import dataclass, replace
from dalembert.results.columns import Table, finite, names
from dalembert.results.way import Topic, figures
from virtualwork.formulas.forces import Effort, JointForce
from virtualwork.formulas.kinematics import Angle, Point
from virtualwork.plan.steps import Group, Place, Slide, Turn, joints, relations
from virtualwork.study.check import Check
from virtualwork.study.loops import loops

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.cases.cases import Rows
    from dalembert.results.columns import Cell, Document, Json
    from dalembert.results.way import Topic
    from virtualwork import Mechanism
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.study.check import Check, FourBar
    from virtualwork.study.strokes import Stroke


@dataclass
class Character(Case):
    """The character of one mechanism: mobility, groups, limits, strokes."""

    study: Inspection
    analysis: Analysis

    @cached_property
    def check(self) -> Check:
        """The study."""
        return Check(self.analysis.mechanism.assembly)

    @cached_property
    def statements(self) -> list[Statement]:
        """What the study says."""
        return statements(self.check, self.analysis.unit)

    def documented(self) -> list[Table]:
        """The statements as JSON has them."""
        return [Table([names(each.name, [each.value]) for each in self.statements], place="check")]

    def table(self) -> Table:
        """A row for each number of a statement, named as in JSON."""
        return listed(("quantity", "of", "value"), [row for each in self.statements for row in each.rows])

    def further(self) -> dict[str, Callable[[], Table]]:
        """The order of solution; what does work."""
        return {
            "order of solution": lambda: order(self.analysis),
            "operations a pose": lambda: operations(self.analysis),
            "virtual work": lambda: working(self.analysis),
        }

    def warnings(self) -> list[str]:
        """What is remarkable about its branches."""
        own = self.analysis.mechanism.assembly.track.warnings()
        return [*self.analysis.warnings, *own, *(line for cam in self.check.cams for line in cam.warnings)]

    def way(self) -> list[Topic]:
        """Mobility, loops, four-bars."""
        four_bars = next(each.value for each in self.statements if each.name == "four_bars")
        return way(self.analysis.mechanism, self.check, four_bars)

    def figure(self) -> Figure:
        """The mechanism in its own pose."""
        from cli.cases.picture import drawn

        return drawn(self.analysis)


@dataclass(frozen=True)
class Inspection(Study):
    """Inspect every case."""

    title = "check"
    method = METHOD

    def case(self, row: Rows | None = None) -> Character:
        """Return the character of the variant of a row, or of the mechanism itself."""
        analysis = self.cases.analysis(row)
        _ = analysis.mechanism.assembly
        return Character(self, replace(analysis, inputs=analysis.inputs.part(0, 1)))


class Statement(NamedTuple):
    """A part of the character of a mechanism, as JSON has it and as rows of the table.

    Attributes
    ----------
    name : str
        Its key in JSON.
    rows : list of (quantity, what it is of, its value)
    """

    name: str
    value: Json
    rows: list[tuple[str, str, Cell]]


def statements(check: Check, unit: str) -> list[Statement]:
    """The character of a mechanism; `unit`: of its input, deg or m."""
    groups, four_bars = list(check.groups), list(map(_four_bar, check.four_bars))
    strokes = [_stroke(stroke, unit) for stroke in check.strokes]
    kinds = [("group", " + ".join(g["links"]), f"{g['kind']}, {g['method']}") for g in groups]
    counts = {"mobility": check.mobility, "mobility_by_rank": check.mobility_by_rank}
    places = {
        "input_limits": check.printed_limits,
        "dead_points": check.dead_points,
        "change_points": check.change_points,
    }
    return [
        *(Statement(name, count, [(name, "", count)]) for name, count in counts.items()),
        Statement(
            "redundant", list(check.redundant), [("redundant", joint, True) for joint in check.redundant]
        ),
        Statement("groups", groups, kinds),  # type: ignore[arg-type]
        *(
            [Statement("singular", list(check.singular), [("singular", of, True) for of in check.singular])]
            if check.singular
            else []
        ),
        Statement("four_bars", [of for of, _ in four_bars], [row for _, rows in four_bars for row in rows]),
        *(_inputs(f"{name}_{unit}", values, unit) for name, values in places.items()),
        Statement(
            "strokes",
            [{"name": name, **numbers} for name, numbers in strokes],
            [(key, name, value) for name, numbers in strokes for key, value in numbers.items()],
        ),
        *([_cams(check)] if check.cams else []),
    ]


def _cams(check: Check) -> Statement:
    """Of every cam the largest pressure angle, the least radius of its profile, the speed of lift-off."""
    entries: list[Document] = []
    for number, cam in enumerate(check.cams):
        entry: Document = {
            "name": cam.name,
            "pressure_angle_deg": math.degrees(cam.pressure_angle),
            "pressure_angle_at_deg": math.degrees(cam.pressure_angle_at),
            "curvature_radius_m": finite(cam.curvature_radius),
            "curvature_radius_at_deg": math.degrees(cam.curvature_radius_at),
            "undercut": cam.undercut,
        }
        off = check.lift_off(number)
        if off is not None:
            entry["lift_off_speed_rad_s"] = finite(off.speed)
            entry["lift_off_at_deg"] = in_turn(math.degrees(off.at))
        entries.append(entry)
    rows = [(key, str(entry["name"]), entry[key]) for entry in entries for key in list(entry)[1:]]
    return Statement("cams", entries, rows)  # type: ignore[arg-type]


def _stroke(stroke: Stroke, unit: str) -> tuple[str, dict[str, float]]:
    """Its name, and its numbers by their keys."""
    own = "deg" if stroke.turns else "m"
    numbers = {"least": (stroke.least, own), "at": (stroke.at, unit)}
    numbers |= {"most": (stroke.most, own), "most_at": (stroke.most_at, unit)}
    return stroke.name, {
        f"{key}_{of}": math.degrees(value) if of == "deg" else value for key, (value, of) in numbers.items()
    }


def _four_bar(four_bar: FourBar) -> tuple[Document, list[tuple[str, str, Cell]]]:
    """Its entry in JSON, and its rows."""
    links, name = list(four_bar.links), ", ".join(four_bar.links)
    angles = [finite(math.degrees(angle)) for angle in four_bar.transmission]
    entry: Document = {"links": links, "grashof": four_bar.grashof, "transmission_deg": angles}
    ends = zip(("least", "largest"), angles, strict=True)
    return entry, [
        ("grashof", name, four_bar.grashof),
        *((f"{end}_transmission_deg", name, angle) for end, angle in ends),
    ]


def _inputs(header: str, values: Sequence[float] | None, unit: str) -> Statement:
    """Special inputs; an end of the range where it goes on is open, null in JSON."""
    shown = None if values is None else [finite(v if unit == "m" else math.degrees(v)) for v in values]
    cells: list[Cell] = ["open" if value is None else value for value in shown or ()] or ["none"]
    several = len(cells) > 1
    return Statement(
        header, shown, [(header, str(i) if several else "", cell) for i, cell in enumerate(cells, 1)]
    )


# --- how it is solved -------------------------------------------------------------------------------------------------
def order(analysis: Analysis) -> Table:
    """The order of solution, a row for each step."""
    m, plan = analysis.mechanism, analysis.assemblies[0].plan
    rows: list[tuple[Cell, ...]] = []
    for i, step in enumerate(plan.steps, 1):
        if isinstance(step, Turn):
            body = step.body
            what = f"slide {m.guides[body].point}" if isinstance(body, int) else f"angle of {body}"
            how = _angle_text(analysis, step)
        elif isinstance(step, Slide):
            what, how = f"slide at {m.guides[step.guide].point}", "the input"
        elif isinstance(step, Place):
            what, how = f"point {step.node}", ""
        else:
            assert isinstance(step, Group)
            newton = step.kind == "Newton"
            what, how = f"group {step.name}", "Newton-Raphson" if newton else f"{step.kind}, closed form"
        rows.append((str(i), what, how))
    return replace(listed(("step", "solved", "from"), rows), place="")


def operations(analysis: Analysis) -> Table:
    """Operations that a pose costs: all its points and links, with rates where the input has any, and all its forces.

    Before them those of the quantities that --only names.
    """
    motion = analysis.motions[0]
    m = motion.mechanism
    moves = any(not isinstance(rate, float) or rate for rates in motion.poses.rates for rate in rates)
    keys: list[Quantity] = []
    counts: dict[str, int] = {}
    if analysis.request.only is not None:
        named = keys_of([*analysis.places, *analysis.forces])
        if motion.poses.takes(named):
            counts[", ".join(analysis.request.only)] = motion.poses.operations(named)
    for order, what in enumerate(("positions", "with velocities", "with accelerations")[: 3 if moves else 1]):
        keys += [Point(body, 0j, p, order) for body in m.links for p in m.bodies[body]]
        keys += [Angle(body, order) for body in m.links]
        counts[what] = motion.poses.operations(keys)
    if motion.assembled.all():
        keys = [JointForce(joint.key, joint.bodies[-1]) for joint in motion.dynamics.reactions.joints]
        keys += [Effort(j) for j in range(len(m.inputs))]
        if motion.poses.takes(keys):
            counts["forces"] = motion.poses.operations(keys)
    return Table([names(what, [float(count)], None) for what, count in counts.items()], place="")


def working(analysis: Analysis) -> Table:
    """Of each load whether it does work at each input, and which kinds of loads there are none of."""
    from virtualwork.study.ledger import ledger

    motion = analysis.motions[0]
    if not motion.assembled.all():
        return Table([])
    rows: list[tuple[Cell, ...]] = []
    for j, entry in enumerate(analysis.mechanism.inputs):
        works, workless, absent = ledger(motion.dynamics.scene, j)
        rows += [(entry.name, load, "works") for load in works]
        rows += [(entry.name, load, "does no work") for load in workless]
        if j == 0:
            missing = [("", line, "absent") for line in absent]
    below = "joint forces, action and reaction, do no work together: none enters the effort"
    return replace(listed(("input", "load", "work"), [*rows, *missing]), place="", below=below)


def _angle_text(analysis: Analysis, step: Turn) -> str:
    inputs = analysis.mechanism.inputs
    parts = [
        f"{k:g}·input {inputs[j].name}" if k != 1 else f"input {inputs[j].name}" for j, k in step.angle.inputs
    ]
    guides = analysis.mechanism.guides
    for base, r in step.angle.bases:
        name = f"slide {guides[base].point}" if isinstance(base, int) else base
        parts.append(f"{r:g}·{name}" if r != 1 else name)
    parts += [f"{'' if r == 1 else '−'}lift of cam {of.cam}" for of, r in step.angle.cams]
    if step.angle.const:
        const = step.angle.const
        parts.append(f"{const:g} m" if isinstance(step.body, int) else f"{math.degrees(const):g} deg")
    return " + ".join(parts) or "fixed"


def way(m: Mechanism, check: Check, four_bars: Any) -> list[Topic]:
    """The topics; `four_bars`: what JSON has of them."""
    n = len(m.links)
    held = sum((len(joint.bodies) - 1) * 2 if joint.guide is None else 1 for joint in joints(m))
    tied = [r for r in relations(m) if r.kind != "input"]
    text = [
        "Each link has three coordinates; a pin of k links takes 2·(k − 1), a slot 1, a slider one more, a gear mesh 1 (Grübler):",
        f"  F = 3·{n} − {held} − {len(tied)} = {3 * n - held - len(tied)}",
    ]
    if check.mobility != 3 * n - held - len(tied):
        text.append(f"  the program counts {check.mobility}")
    if check.mobility_by_rank != check.mobility:
        text.append(f"  by the rank of the Jacobian {check.mobility_by_rank}: some constraints repeat others")
    head: dict[str, Any] = {
        "links": n, "pins_and_slots": held, "sliders_and_gears": len(tied), "mobility": check.mobility,
    }  # fmt: skip
    topics = [Topic("mobility", text, "Mobility", head)]
    texts = [loop.text for loop in loops(m, m.assembly.plan)]
    if texts:
        topics.append(Topic("loops", texts, "Vector loops (Ibrahim, eqs. 1.3.1, 1.3.3)", {"loops": texts}))
    lines = [
        f"  {', '.join(f['links'])}: {f['grashof']}; transmission angle "
        f"{' to '.join('-' if v is None else figures(v) + '°' for v in f['transmission_deg'])}"
        for f in four_bars
    ]
    if lines:
        text = [
            "A four-bar turns fully where its shortest and longest link together are no longer than the other two (Grashof):"
        ]
        topics.append(Topic("four-bars", [*text, *lines], "Four-bars", {"four_bars": four_bars}))
    return topics
