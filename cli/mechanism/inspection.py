"""The character of a mechanism: as a table, as JSON, the order of its solution; the worked solution."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from cli.cases.analysis import Analysis
from cli.cases.case import Case, Study
from cli.cases.poses import keys_of, listed
from cli.cases.study import METHOD
from dalembert.angles import in_turn
from dalembert.dataclass import dataclass, replace
from dalembert.results.columns import ABSENT, Column, Table, document, finite, names
from dalembert.results.text import as_list
from dalembert.results.way import Topic, figures
from virtualwork.formulas.forces import Effort, JointForce
from virtualwork.formulas.kinematics import Angle, Point
from virtualwork.plan.steps import Group, Place, Slide, Turn, joints, relations
from virtualwork.study.check import Check
from virtualwork.study.loops import loops

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.results.columns import Cell
    from dalembert.results.result import Result
    from virtualwork import Mechanism
    from virtualwork.formulas.quantity import Quantity
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
    def quantities(self) -> dict[str, Table]:
        """The tables of the study, in the order of JSON."""
        return quantities(self.check, self.analysis.unit)

    def document(self) -> dict[str, Any]:
        """Return the quantities; strokes and swings are one list."""
        check: dict[str, Any] = {}
        for table in self.quantities.values():
            # lists do not name rows of further tables
            for key, entry in document([replace(table, keys=())]).items():
                check[key] = [*check[key], *entry] if key in check else entry  # type: ignore[misc]
        return {"check": check}

    def table(self) -> Table:
        """Return a row for each quantity, named as in JSON."""
        rows = [row for table in self.quantities.values() for row in one_below_the_other(table)]
        return listed(("quantity", "of", "value"), rows)

    def further(self) -> dict[str, Callable[[], Table]]:
        """Return the tables of several rows, the order of solution, the operations, and the loads that do work."""
        # the order of solution has the groups
        several = [name for name, table in self.quantities.items() if table.keys and name != "groups"]
        return {
            **{name: partial(self._further, name) for name in several},
            "order of solution": lambda: order(self.analysis),
            "operations a pose": lambda: operations(self.analysis),
            "virtual work": lambda: working(self.analysis),
            "absent loads": lambda: absent(self.analysis),
        }

    def _further(self, name: str) -> Table:
        table = self.quantities[name]
        return table if table.length else Table([])

    def result(self) -> Result:
        """Return the result in every form: a terminal and a report have what is there once as a list."""
        result = super().result()
        once = [column for table in self.quantities.values() if not table.keys for column in table.columns]
        result.screen = lambda: [as_list(Table([column for column in once if column.values[0] != ""]))]
        return result

    def warnings(self) -> list[str]:
        """Return the warnings of its branches and cams."""
        own = self.analysis.mechanism.assembly.track.warnings()
        return [*self.analysis.warnings, *own, *(line for cam in self.check.cams for line in cam.warnings)]

    def way(self) -> list[Topic]:
        """Return mobility, loops and four-bars."""
        return way(self.analysis.mechanism, self.check, self.document()["check"]["four_bars"])

    def figure(self) -> Figure:
        """Draw the mechanism in its own pose."""
        from cli.cases.picture import drawn

        return drawn(self.analysis)


@dataclass(frozen=True)
class Inspection(Study):
    """Inspect every case."""

    title = "check"
    method = METHOD

    def case(self, analysis: Analysis) -> Character:
        """Return the character of one mechanism."""
        _ = analysis.mechanism.assembly
        return Character(self, replace(analysis, inputs=analysis.inputs.part(0, 1)))


# --- its quantities ---------------------------------------------------------------------------------------------------
def quantities(check: Check, unit: str) -> dict[str, Table]:
    """Return the tables of the character of a mechanism; `unit`: of its input, deg or m."""
    groups, four_bars, strokes = _groups(check), _four_bars(check), check.strokes
    limits = {
        "input_limits": check.printed_limits,
        "dead_points": check.dead_points,
        "change_points": check.change_points,
    }
    once = [names("mobility", [check.mobility]), names("mobility_by_rank", [check.mobility_by_rank])]
    tables = {
        "mobility": Table([*once, _listed_names("redundant", check.redundant)], place=""),
        "groups": groups,
        "singular": Table([_listed_names("singular", check.singular)] if check.singular else [], place=""),
        "four-bars": four_bars,
        "limits": Table([_inputs(name, values, unit) for name, values in limits.items()], place=""),
        "strokes": _strokes([each for each in strokes if not each.turns], "length", unit),
        "swings": _strokes([each for each in strokes if each.turns], "angle", unit),
    }
    return {**tables, "cams": _cams(check)} if check.cams else tables


def _listed_names(name: str, values: Sequence[str]) -> Column:
    """Return several names as one quantity, a list in JSON."""
    return Column(name, "", [", ".join(values)], place=name, stored=[list(values)])


def _inputs(name: str, values: Sequence[float] | None, unit: str) -> Column:
    """Return special inputs as one quantity, a list in JSON, in which an open end of the range is null."""
    shown = None if values is None else [finite(v if unit == "m" else math.degrees(v)) for v in values]
    text = ", ".join("open" if v is None else f"{v:.6g}" for v in shown or ())
    return Column(name, unit, [text or "none"], place=f"{name}_{unit}", stored=[shown])


def _groups(check: Check) -> Table:
    """Return the Assur groups in their order of solution."""
    links = [each["links"] for each in check.groups]
    kinds, methods = ([each[key] for each in check.groups] for key in ("kind", "method"))
    columns = [
        Column("links", "", [" + ".join(each) for each in links], place="links", stored=links),
        names("group", [f"{kind}, {method}" for kind, method in zip(kinds, methods, strict=True)], None),
    ]
    return Table(columns, ("links",), "groups[]", documented=[names("kind", kinds), names("method", methods)])


def _four_bars(check: Check) -> Table:
    """Return the class and the range of the transmission angle of every four-bar."""
    links = [list(each.links) for each in check.four_bars]
    ends = [[math.degrees(angle) for angle in each.transmission] for each in check.four_bars]
    columns = [
        Column("links", "", [", ".join(each) for each in links], place="links", stored=links),
        names("grashof", [each.grashof for each in check.four_bars]),
        *(
            Column(
                f"{end}_transmission", "deg", [angles[i] for angles in ends], place=f"transmission_deg.{i}"
            )
            for i, end in enumerate(("least", "largest"))
        ),
    ]
    return Table(columns, ("links",), "four_bars[]")


def _strokes(strokes: Sequence[Stroke], dimension: str, unit: str) -> Table:
    """Return how far slides and points travel, or links swing: the ends, and the inputs there."""
    own = {"length": "m", "angle": "deg"}[dimension]
    columns = [
        _in_unit(name, of, [math.degrees(v) if of == "deg" else v for v in values])
        for name, of, values in (
            ("least", own, [each.least for each in strokes]),
            ("at", unit, [each.at for each in strokes]),
            ("most", own, [each.most for each in strokes]),
            ("most_at", unit, [each.most_at for each in strokes]),
        )
    ]
    what = {"length": "slides and points", "angle": "links that do not turn fully"}[dimension]
    above = f"least and largest place of {what}, with the input there"
    return Table([names("name", [each.name for each in strokes]), *columns], ("name",), "strokes[]", above)


def _cams(check: Check) -> Table:
    """Return the largest pressure angle, the least radius of the profile and the speed of lift-off of every cam."""
    cams = check.cams
    columns = [
        names("name", [each.name for each in cams]),
        _in_unit("pressure_angle", "deg", [math.degrees(each.pressure_angle) for each in cams]),
        _in_unit("pressure_angle_at", "deg", [math.degrees(each.pressure_angle_at) for each in cams]),
        _in_unit("curvature_radius", "m", [finite(each.curvature_radius) for each in cams]),
        _in_unit("curvature_radius_at", "deg", [math.degrees(each.curvature_radius_at) for each in cams]),
        names("undercut", [each.undercut for each in cams]),
    ]
    every = [check.lift_off(number) for number in range(len(cams))]
    if any(every):
        speeds = [None if off is None else finite(off.speed) for off in every]
        inputs = [None if off is None else in_turn(math.degrees(off.at)) for off in every]
        lift_off = [_in_unit("lift_off_speed", "rad_s", speeds), _in_unit("lift_off_at", "deg", inputs)]
        for column in lift_off:
            stored = zip(column.values, every, strict=True)
            column.stored = [ABSENT if off is None else value for value, off in stored]
        columns += lift_off
    return Table(columns, ("name",), "cams[]")


def _in_unit(name: str, unit: str, values: Sequence[Cell]) -> Column:
    return Column(name, unit, values, place=f"{name}_{unit}")


def one_below_the_other(table: Table) -> Iterator[tuple[str, str, Cell]]:
    """Yield every quantity of a table, what it is of, and its value; of a list, each element."""
    columns = table.columns[1:] if table.keys else table.columns
    for i in range(table.length):
        of = str(table.columns[0].values[i]) if table.keys else ""
        for column in columns:
            # a list is shown as a text
            value = column.documented[i] if column.stored is not None else column.values[i]
            if isinstance(value, list) or (value is None and isinstance(column.values[i], str)):
                yield from _elements(column, value or ())
            elif value is not ABSENT:
                yield column.header, of, value


def _elements(column: Column, values: Sequence[Any]) -> Iterator[tuple[str, str, Cell]]:
    """Yield the elements of a list: names by themselves, inputs by their number where there are several."""
    if not column.unit:
        yield from ((column.header, name, True) for name in values)
        return
    cells = ["open" if value is None else value for value in values] or ["none"]
    for k, cell in enumerate(cells, 1):
        yield column.header, str(k) if len(cells) > 1 else "", cell


# --- how it is solved -------------------------------------------------------------------------------------------------
def order(analysis: Analysis) -> Table:
    """Return the order of solution, a row for each step."""
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
    """Count the operations of a pose: all its points and links, with rates where the input has any, and all its forces.

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
    return Table([names(what, [count], None) for what, count in counts.items()], place="")


def working(analysis: Analysis) -> Table:
    """Return whether each load does work at each input."""
    from virtualwork.study.ledger import ledger

    motion = analysis.motions[0]
    rows: list[tuple[Cell, ...]] = []
    for j, entry in enumerate(analysis.mechanism.inputs if motion.assembled.all() else ()):
        works, workless, _ = ledger(motion.dynamics, j)
        rows += [(entry.name, load, "works") for load in works]
        rows += [(entry.name, load, "does no work") for load in workless]
    below = "joint forces (action and reaction) do no work: the effort does not depend on them"
    return replace(listed(("input", "load", "work"), rows), place="", below=below) if rows else Table([])


def absent(analysis: Analysis) -> Table:
    """Return the kinds of loads that are absent."""
    from virtualwork.study.ledger import ledger

    motion = analysis.motions[0]
    *_, lines = ledger(motion.dynamics, 0) if motion.assembled.all() else [()]
    return Table([Column("load", "", lines)] if lines else [], place="")


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
    """Return the topics; `four_bars`: their entries in JSON."""
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
        text.append(f"  by the rank of the Jacobian {check.mobility_by_rank}: some constraints are redundant")
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
