"""Elements of markup that need not be well formed: no entities, no declarations, nothing is expanded.

Linkage writes, and forgives, attributes without a blank between them; a strict reader of XML would not.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import unescape

from cli.imports.words import damaged
from dalembert.errors import DataError

ATTRIBUTE = re.compile(r"""([A-Za-z_][\w.-]*)\s*=\s*("[^"<]*"|'[^'<]*')""")
DEEPEST = 20


@dataclass
class Element:
    """A tag with its attributes and what stands inside; `line` is where it begins."""

    tag: str
    line: int
    attributes: dict[str, str] = field(default_factory=dict)
    inside: list[Element] = field(default_factory=list)

    @property
    def id(self) -> str:
        """What it is called; empty where it is not."""
        return self.attributes.get("id", "")

    def all(self, *tags: str) -> Iterator[Element]:
        """Yield the elements of some tags directly inside, whatever their case."""
        return (e for e in self.inside if e.tag.lower() in tags)


def parse(file: str, text: str) -> Element:
    """Return the outermost element; DataError names the line of what is wrong."""
    root = Element("", 1)
    open_ = [root]
    line, at = 1, 0
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
