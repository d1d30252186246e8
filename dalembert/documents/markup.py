"""XML in and out: entities and declarations are refused, errors name the place of a number, numbers are written with every digit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, ParseError, SubElement, indent, tostring
from xml.parsers.expat import errors
from xml.parsers.expat.errors import codes

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.documents.values import MOST_PARTS, check_count, check_size, damaged, finite
from dalembert.errors import DataError
from dalembert.tables.files import load

DEEPEST = 100
# files that a file may include
INCLUDES = 20
# characters that no XML can hold
FORBIDDEN = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
UNBOUND_PREFIX = codes[errors.XML_ERROR_UNBOUND_PREFIX]


def parse(file: str, data: bytes, most: int = MOST_PARTS) -> Element:
    """Return the outermost element of a file of at most so many; DataError names the line of what is wrong."""
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    check_size(file, data)
    data = _in_utf_8(data)
    try:
        try:
            root: Element = fromstring(data, forbid_dtd=True, forbid_entities=True, forbid_external=True)
        except ParseError as error:
            if error.code != UNBOUND_PREFIX:
                raise
            declared = _with_prefixes(data)
            root = fromstring(declared, forbid_dtd=True, forbid_entities=True, forbid_external=True)
    except DefusedXmlException:
        raise DataError(f"{file}: declarations and entities of XML are refused") from None
    except ParseError as error:
        line, column = error.position
        what = str(error).partition(":")[0]
        raise DataError(
            f"{file}: line {line}, column {column + 1}: no valid XML ({what}); is the file cut off?"
        ) from None
    except (ValueError, LookupError) as error:
        raise DataError(f"{file}: no valid XML: {error}") from None
    _plain(file, root)
    check_count(file, sum(1 for _ in root.iter()), "elements", most)
    return root


def _with_prefixes(data: bytes) -> bytes:
    """Return a file with the prefixes of its elements and attributes declared in its outermost element.

    Robot files name their extensions so, `<drake:joint>`, and often do not declare the prefix.

    >>> _with_prefixes(b'<sdf><drake:joint/></sdf>')
    b'<sdf xmlns:drake="drake"><drake:joint/></sdf>'
    """
    used = dict.fromkeys(re.findall(rb"</?([A-Za-z_][\w.-]*):[A-Za-z_]", data))
    used |= dict.fromkeys(re.findall(rb"\s([A-Za-z_][\w.-]*):[A-Za-z_][\w.-]*\s*=", data))
    declared = {b"xml", b"xmlns", *re.findall(rb"xmlns:([\w.-]+)", data)}
    new = [p for p in used if p not in declared]
    more = b"".join(b' xmlns:%b="%b"' % (p, p) for p in new)
    # what is not closed ends with the file
    blank = re.sub(rb"<!--.*?(?:-->|\Z)|<\?.*?(?:\?>|\Z)", lambda m: b" " * len(m[0]), data, flags=re.DOTALL)
    root = re.search(rb"<[A-Za-z_][\w.:-]*", blank)
    return data if root is None else data[: root.end()] + more + data[root.end() :]


def _plain(file: str, root: Element) -> None:
    """Take the name spaces off the tags; refuse elements that are nested too deeply."""
    level = [root]
    for _ in range(DEEPEST):
        for element in level:
            element.tag = element.tag.rpartition("}")[2]
        level = [inner for outer in level for inner in outer]
    if level:
        raise DataError(f"{file}: elements nested more than {DEEPEST} deep")


def _in_utf_8(data: bytes) -> bytes:
    """Return a file without a declared encoding that is no UTF-8 as Windows-1252 reads it."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff") or b"encoding" in data[:200].partition(b"?>")[0]:
        return data
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace").encode()
    return data


def children(element: Element, *tags: str) -> Iterator[Element]:
    """Yield the elements of some tags directly inside."""
    return (e for e in element if e.tag in tags)


def child(element: Element | None, *path: str) -> Element | None:
    """Return the first element of a tag directly inside, the first of the next tag in that, and so on."""
    for tag in path:
        element = None if element is None else next(children(element, tag), None)
    return element


def text(element: Element | None, *path: str) -> str | None:
    """Return the text at the end of such a path, without the blanks around it; None where there is none."""
    result = child(element, *path)
    return None if result is None or result.text is None else result.text.strip()


def passed_over(root: Element, known: Mapping[str, str]) -> list[str]:
    """Name the elements that nothing reads.

    Parameters
    ----------
    root : Element
    known : mapping of str
        Tag -> the tags in it that are read, or that say nothing of a mechanism; elements of other tags are not searched.

    Examples
    --------
    >>> passed_over(parse("f", b"<robot><link><inertia1/></link></robot>"), {"robot": "link", "link": "inertial"})
    ['<inertia1> in <link>: left out: it is not read']
    """
    lost = []
    for inner in root:
        if inner.tag not in known[root.tag].split():
            lost.append(f"<{inner.tag}> in <{root.tag}>: left out: it is not read")
        elif inner.tag in known:
            lost += passed_over(inner, known)
    return list(dict.fromkeys(lost))


class At(NamedTuple):
    """A place in a file, as messages name it; `of` names the element there."""

    file: str
    where: str

    def inside(self, of: str) -> At:
        """Return a place inside this one."""
        return At(self.file, f"{self.where}, {of}" if of else self.where)

    def error(self, of: str, value: object, expected: object) -> DataError:
        """Return the error: the value there, and the expected value."""
        return damaged(self.file, self.inside(of).where, value, str(expected))

    def number(self, of: str, text: str | None) -> float:
        """Return a finite number."""
        return finite(self.file, self.inside(of).where, text)

    def numbers(
        self, of: str, text: str | None, n: int | None = None, default: Sequence[float] | None = None
    ) -> list[float]:
        """Return n finite numbers, or however many there are; `default` where there is no text."""
        if text is None and default is not None:
            return list(default)
        numbers = [self.number(of, word) for word in (text or "").split()]
        if n is not None and len(numbers) != n:
            raise self.error(of, text or "", f"{n} number{'s' * (n != 1)}")
        return numbers

    def direction(self, of: str, vector: ArrayLike) -> NDArray[np.float64]:
        """Return a direction of length 1."""
        v = np.array(vector, dtype=float)
        length = float(np.linalg.norm(v))
        if not length > 0:
            raise self.error(of, "0 0 0", "a direction")
        return np.asarray(v / length)


def named(file: str, element: Element, attribute: str = "name") -> str:
    """Return an attribute that must be there."""
    value = element.get(attribute)
    if not value:
        raise DataError(f"{file}: a <{element.tag}> has no '{attribute}'")
    return value


def placed(file: str, element: Element) -> tuple[str, At]:
    """Return an element's name, which must be there, and its place."""
    name = named(file, element)
    return name, At(file, f"{element.tag} '{name}'")


def include(file: str, element: Element, folder: Path | None, seen: list[int]) -> None:
    """Put the files that are included in the place of their `<include>` elements; `seen` counts them."""
    for i, e in reversed(list(enumerate(element))):
        if e.tag != "include":
            include(file, e, folder, seen)
            continue
        name = named(file, e, "file")
        if folder is None:
            raise DataError(f"{file}: <include file='{name}'>: standard input has no folder")
        path, base = (folder / name).resolve(), folder.resolve()
        if not path.is_relative_to(base):
            raise DataError(f"{file}: <include file='{name}'>: it lies outside the file's folder: not read")
        seen[0] += 1
        if seen[0] > INCLUDES:
            raise DataError(f"{file}: more than {INCLUDES} files are included")
        try:
            inner = parse(name, load(path))
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            raise DataError(f"{file}: <include file='{name}'>: {reason}") from None
        include(file, inner, folder, seen)
        element[i : i + 1] = list(inner)


def digits(*values: float) -> str:
    """Return numbers that are read back as the same.

    >>> digits(0.1, -0.0, 1)
    '0.1 0.0 1.0'
    """
    return " ".join(repr(float(v) + 0.0) for v in values)


def add(parent: Element, tag: str, text: str | None = None, **attributes: str | float) -> Element:
    """Add an element inside another; an underscore behind a name is dropped (`class_`)."""
    made = SubElement(
        parent, tag, {k.rstrip("_"): v if isinstance(v, str) else digits(v) for k, v in attributes.items()}
    )
    made.text = text
    return made


def comment(text: str) -> str:
    """Return a comment, whatever the text holds."""
    return f"<!-- {re.sub('-(?=-|$)', '- ', FORBIDDEN.sub('_', text))} -->"


def document(root: Element, source: str) -> bytes:
    """Return the file."""
    for element in root.iter():
        element.attrib = {k: FORBIDDEN.sub("_", v) for k, v in element.attrib.items()}
        element.text = element.text and FORBIDDEN.sub("_", element.text)
    indent(root)
    body = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{comment(source)}\n{body}\n'.encode()
