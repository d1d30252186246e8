"""Linkage (.linkage2): elements of markup that need not be well formed, and the mechanism that they draw."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from html import unescape

from dalembert.documents.values import MOST_PARTS, check_count, damaged, exact, finite
from dalembert.errors import DataError
from virtualwork.describe.parts import Gear, Guide
from virtualwork.exchange.drawn import GROUND, Drawing, Drive, Groups, centers, unused
from virtualwork.exchange.places import Exact, apart, direction

ATTRIBUTE = re.compile(r"""([A-Za-z_][\w.-]*)\s*=\s*("[^"<]*"|'[^'<]*')""")
DEEPEST = 20


@dataclass
class Element:
    """A tag with its attributes and its contents; `line` is where it begins."""

    tag: str
    line: int
    attributes: dict[str, str] = field(default_factory=dict)
    inside: list[Element] = field(default_factory=list)

    @property
    def id(self) -> str:
        """The id; empty where there is none."""
        return self.attributes.get("id", "")

    def all(self, *tags: str) -> Iterator[Element]:
        """Yield the elements of some tags directly inside, whatever their case."""
        return (e for e in self.inside if e.tag.lower() in tags)


def parse(file: str, text: str) -> Element:
    """Return the outermost element; DataError names the line of what is wrong."""
    root = Element("", 1)
    open_ = [root]
    line, at = 1, 0
    check_count(file, text.count("<"), "elements", 2 * MOST_PARTS)
    for match in re.finditer(r"<!--.*?-->|<([^<>]*)>|<", text, re.DOTALL):
        line, at = line + text.count("\n", at, match.start()), match.start()
        where = f"line {line}"
        tag = match[1]
        if match[0].startswith("<!--") or (tag or "").startswith("?"):
            continue
        if text.startswith("<!", at):
            raise DataError(f"{file}: {where}: declarations and entities are refused")
        if tag is None:
            raise damaged(file, where, text[at : at + 40], "a tag that ends with '>'; is the file cut off?")
        if tag.startswith("/"):
            name = tag[1:].strip()
            if len(open_) == 1 or open_[-1].tag.lower() != name.lower():
                raise damaged(file, where, f"</{name}>", f"</{open_[-1].tag}>")
            open_.pop()
            continue
        name = re.match(r"\s*([\w:.-]*)", tag)
        assert name is not None
        element = Element(name[1], line)
        for key, value in ATTRIBUTE.findall(tag[name.end() :]):
            # the five characters that XML names itself; no other entity exists here
            element.attributes.setdefault(key.lower(), unescape(value[1:-1]) if ";" in value else value[1:-1])
        open_[-1].inside.append(element)
        if not tag.rstrip().endswith("/"):
            open_.append(element)
            if len(open_) > DEEPEST:
                raise DataError(f"{file}: {where}: elements nested more than {DEEPEST} deep")
    if len(open_) > 1:
        raise DataError(f"{file}: line {line}: <{open_[-1].tag}> is not closed; is the file cut off?")
    if not root.inside:
        raise DataError(f"{file}: line 1: no element")
    return root.inside[0]


# the file's unit in the unit of the description
UNITS = {"in": Fraction(1, 96), "mm": Fraction(254, 960)}
DRAWING_LAYERS = {"1", "2"}
# cycles a minute of an actuator that names none
DEFAULT_CPM = 15.0


def read(file: str, text: str) -> list[Drawing]:
    """Read the document; what has nothing but the ground in common is distinguished later."""
    return [_Reader(file, parse(file, text)).drawing()]


def yes(e: Element, key: str) -> bool:
    """Return whether an attribute is set."""
    return e.attributes.get(key, "").lower() in ("true", "1", "yes")


class _Reader:
    """Reads one document: a body for each link; errors name the line."""

    def __init__(self, file: str, root: Element) -> None:
        self.file, self.root = file, root
        program = next(root.all("program"), Element("program", 1))
        units = program.attributes.get("units", "").lower()
        self.d = Drawing(length="mm" if units.startswith(("milli", "mm")) else "in")
        if not units:
            self.d.notes.append("the file has no unit: its numbers are 1/96 inch, written in inches")
        self.scale = UNITS[self.d.length]
        if self.number(program, "scalefactor", 1.0) != 1.0:
            self.d.leave("scalefactor", "it scales the display, not the coordinates")

    def number(self, e: Element, key: str, default: float | None = None) -> float:
        """Return a finite number of an attribute."""
        result = e.attributes.get(key)
        if result is None and default is not None:
            return default
        return finite(self.file, f"line {e.line}: <{e.tag}> {key}", result)

    def drawing(self) -> Drawing:
        d, file = self.d, self.file
        self.connectors: dict[str, Element] = {}
        self.at: dict[str, Exact] = {}
        layers = 0
        for e in self.root.all("connector"):
            if not e.id:
                raise damaged(file, f"line {e.line}: <connector>", "no id", "an id")
            if e.attributes.get("layer") in DRAWING_LAYERS:
                layers += 1
                continue
            if e.id in self.connectors:
                d.leave(f"second connector {e.id} (line {e.line})", "the program uses the first with that id")
                continue
            x, y = (exact(self.number(e, key)) * self.scale for key in "xy")
            self.connectors[e.id], self.at[e.id] = e, Exact(x, y)
        self.links: dict[str, Element] = {}
        self.held: dict[str, list[str]] = {}
        for e in self.root.all("link", "element"):
            # several links may have one id, or none: the first of them is called so
            id_ = e.attributes["id"] = unused(e.attributes.get("id", "0"), self.links)
            if e.attributes.get("layer") in DRAWING_LAYERS:
                layers += 1
                continue
            ids = [c.id for c in e.all("connector")]
            for c in ids:
                if c not in self.connectors:
                    raise damaged(file, f"line {e.line}: <{e.tag}> {id_}", c, "the id of a connector")
            self.links[id_], self.held[id_] = e, list(dict.fromkeys(ids))
        if layers:
            d.leave(f"{layers} elements of layers 1 and 2", "they are drawing only")
        if not self.connectors or not self.links:
            raise damaged(file, f"line {self.root.line}", f"<{self.root.tag}>", "connectors and links")
        for id_, e in self.connectors.items():
            if yes(e, "anchor"):
                d.bodies[GROUND].points[f"C{id_}"] = self.at[id_]
        for id_ in self.links:
            self._link(id_)
        for e in (*self.connectors.values(), *self.links.values()):
            self._fasten(e)
        self.rigid = Groups(d.bodies)
        for pair in d.welds:
            self.rigid.join(*pair)
        for id_, e in self.connectors.items():
            if yes(e, "slider"):
                self._slide(id_, e)
        for id_, e in self.connectors.items():
            if yes(e, "input"):
                self._motor(id_, e)
        self._traced()
        for ratios in self.root.all("ratios"):
            for ratio in ratios.all("ratio"):
                self._ratio(ratio)
        return d

    def _link(self, id_: str) -> None:
        d, e, ids = self.d, self.links[id_], self.held[id_]
        wanted = yes(e, "actuator")
        if wanted and not (len(ids) == 2 and apart(self.at[ids[0]], self.at[ids[1]]) > 0):
            d.notes.append(f"actuator L{id_}: its two ends coincide: it is a link that keeps its length")
        elif wanted:
            a, b = ids
            names = f"L{id_}", f"L{id_} rod"
            slider = d.cylinder(names, (f"C{a}", f"C{b}"), (self.at[a], self.at[b]))
            throw, cpm = self.number(e, "throw", 0.0), self.number(e, "cpm", DEFAULT_CPM)
            speed = None
            if throw * cpm != 0 and not yes(e, "alwaysmanual"):
                speed = f"{float(exact(2 * throw * cpm) * self.scale / 60)!r} {d.length}/s"
                d.notes.append(
                    f"actuator L{id_}: its speed is the mean over a stroke (throw {throw:g}, {cpm:g} cycles a minute); "
                    "the ends of its stroke are left out"
                )
            d.drives.append(Drive(slider=slider, speed=speed))
            return
        body = d.body(f"L{id_}")
        for c in ids:
            body.points[f"C{c}"] = self.at[c]

    def _body(self, e: Element) -> str | None:
        """Return the body of a link, or of a connector: the ground's, or the first link's that has it."""
        if e is self.links.get(e.id):
            return f"L{e.id}"
        if e is self.connectors.get(e.id):
            links = (f"L{k}" for k, held in self.held.items() if e.id in held)
            return next(links, GROUND if yes(e, "anchor") else None)
        return None

    def _fasten(self, e: Element) -> None:
        """`fastenlink` and `fastenconnector`, as attributes or as elements inside: rigidly joined."""
        wanted = [(k, v) for k, v in e.attributes.items() if k in ("fastenlink", "fastenconnector")]
        wanted += [(c.tag.lower(), c.id) for c in e.all("fastenlink", "fastenconnector")]
        for kind, id_ in wanted:
            fastened = (self.links if kind == "fastenlink" else self.connectors).get(id_)
            if fastened is None:
                self.d.leave(f"{kind} {id_} (line {e.line})", "there is none with that id")
                continue
            mine, its = self._body(e), self._body(fastened)
            if mine is None and its is not None:
                self.d.body(its).points[f"C{e.id}"] = self.at[e.id]
            elif its is None and mine is not None:
                self.d.body(mine).points[f"C{fastened.id}"] = self.at[fastened.id]
            elif mine is not None and its is not None and mine != its:
                self.d.welds.append((its, mine))

    def _slide(self, id_: str, e: Element) -> None:
        d, what = self.d, f"slider C{id_}"
        limits = [c.id for c in e.all("slidelimit")]
        if len(limits) != 2 or not set(limits) <= self.at.keys():
            raise damaged(self.file, f"line {e.line}: {what}", limits, "two slidelimits that are connectors")
        if self.number(e, "slideradius", 0.0) != 0:
            d.leave(f"slideradius of C{id_}", "there is no joint on an arc")
            return
        a, b = (self.at[c] for c in limits)
        if apart(a, b) == 0:
            d.leave(what, "its two limits coincide: they give no direction")
            return
        carriers = [k for k, held in self.held.items() if set(limits) <= set(held)]
        both = all(yes(self.connectors[c], "anchor") for c in limits)
        if not carriers and not both:
            d.leave(what, "its two limits are on no link, nor on the ground")
            return
        on = f"L{carriers[0]}" if carriers else GROUND
        point = f"C{id_}"
        held = [n for n in d.holders(point) if n != on]
        if not held:
            d.leave(what, "no link is on it")
            return
        z = self.at[id_]
        d.moved((a, b), z, what, "it")
        d.add(Guide(point, held[0] if GROUND in held else held[-1], on, z, direction(a, b)))

    def _motor(self, id_: str, e: Element) -> None:
        d, what = self.d, f"input C{id_}"
        links = [f"L{k}" for k, held in self.held.items() if id_ in held and f"L{k}" in d.bodies]
        if not yes(e, "anchor"):
            d.leave(what, "its motor is not on an anchor")
            return
        turning = [n for n in links if not self._fixed(n)]
        if self.number(e, "limitangle", 0.0) > 0:
            d.leave(f"the limit of {what}", "the input turns without a limit")
        if not turning:
            d.leave(what, "no link on it can turn")
            return
        d.weld(turning)
        rpm = self.number(e, "rpm", 0.0)
        by_hand = (
            rpm == 0 or yes(e, "alwaysmanual") or any(yes(self.links[n[1:]], "alwaysmanual") for n in turning)
        )
        if by_hand:
            d.notes.append(f"{what}: moved by hand: no speed")
        d.drives.append(Drive(turning[0], speed=None if by_hand else f"{-rpm!r} rpm"))

    def _fixed(self, name: str) -> bool:
        """Return whether a link is the ground: it and what is fastened to it have two anchors apart, or the ground's."""
        top = self.rigid.of(name)
        alike = [k for k in self.links if f"L{k}" in self.d.bodies and self.rigid.of(f"L{k}") == top]
        anchors = [c for k in alike for c in self.held[k] if yes(self.connectors[c], "anchor")]
        return top == self.rigid.of(GROUND) or len({self.at[c] for c in anchors}) > 1

    def _traced(self) -> None:
        for id_, e in self.connectors.items():
            if yes(e, "draw") and not self.d.holders(f"C{id_}"):
                self.d.leave(f"C{id_}", "no link has it")

    def _ratio(self, ratio: Element) -> None:
        d = self.d
        sides = list(ratio.all("link"))
        ids = [e.id for e in sides]
        if len(sides) != 2 or not set(ids) <= self.links.keys():
            raise damaged(self.file, f"line {ratio.line}: <ratio>", ids, "two links of the file")
        sizes = [self.number(e, "size", 0.0) for e in sides]
        what = f"gears L{ids[0]}, L{ids[1]}"
        if sizes[0] * sizes[1] == 0:
            d.leave(what, "a size is 0")
            return
        first, second = (f"L{i}" for i in ids)
        # where the one carries the other's centre, they cannot turn against each other
        for one, other in (ids, ids[::-1]):
            if self.held[one] and self.held[other] and self.held[other][0] in self.held[one][1:]:
                d.welds.append((f"L{one}", f"L{other}"))
                d.notes.append(f"{what}: L{one} carries the centre of L{other}: they are one body")
                return
        radii = next(centers(d, first, second), None)
        if radii is None:
            d.leave(what, "no link holds the centres of both")
            return
        sense = 1.0 if ratio.attributes.get("type", "").lower() == "chain" else -1.0
        d.gears.append(Gear((first, second), sense * sizes[0] / sizes[1], radii[2]))
