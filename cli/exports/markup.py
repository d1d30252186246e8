"""XML as the robot formats want it: a comment with the source, every digit of a number."""

from __future__ import annotations

import re
from xml.etree.ElementTree import Element, SubElement, indent, tostring

# characters that no XML can hold
FORBIDDEN = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def digits(*values: float) -> str:
    """Return numbers that are read back as the same.

    >>> digits(0.1, -0.0, 1)
    '0.1 0.0 1.0'
    """
    return " ".join(repr(float(v) + 0.0) for v in values)


def spatial(z: complex) -> str:
    """Return a place of the plane as one of space."""
    return digits(z.real, z.imag, 0.0)


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
