"""Write docs/library.md from the docstrings of the library: `python -m benchmarks.library_page > docs/library.md`."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from importlib import import_module

import dalembert

_HEAD = """# The library

This page lists every public name with the first sentence of its docstring. `help(NAME)` shows parameters, units, errors, sources
and an example. `import dalembert` has all names in one namespace; a longer name there stands in brackets.
`python -m benchmarks.library_page` writes this page.
"""

_CONSTANTS = {
    "GRADES": "The balance quality grades of ISO 21940-11, mm/s",
    "ZONE_BOUNDARIES": "The classes of machines whose vibration zones ISO 10816-3 bounds",
    "SHAPES": "The shapes of parts",
}

_PACKAGES = {"balancing": "Rotors", "virtualwork": "Mechanisms", "rigidbody3d": "Bodies in space"}


def page() -> Iterator[str]:
    """Yield the lines of the page."""
    yield from _HEAD.splitlines()
    long = {id(getattr(dalembert, name)): name for name in dir(dalembert) if not name.startswith("_")}
    for package, subject in _PACKAGES.items():
        module = import_module(package)
        summary = inspect.getdoc(module) or ""
        yield from (
            "",
            f"## {subject}: `{package}`",
            "",
            *summary.splitlines(),
            "",
            "| name | |",
            "|---|---|",
        )
        for name in module.__all__:
            value = getattr(module, name)
            other = long.get(id(value), name)
            shown = f"`{name}`" if other == name else f"`{name}` (`dalembert.{other}`)"
            shown += " (module)" if inspect.ismodule(value) else ""
            yield f"| {shown} | {first_sentence(name, value)} |"


def first_sentence(name: str, value: object) -> str:
    """Return the first sentence of a name's docstring; of a constant, what it holds.

    >>> first_sentence("first_sentence", first_sentence)
    "Return the first sentence of a name's docstring; of a constant, what it holds."
    """
    if isinstance(value, str):
        text = f'The name of the fixed body, "{value}".'
    elif isinstance(value, dict | tuple):
        text = f"{_CONSTANTS[name]}: {', '.join(map(str, value))}."
    else:
        text = (inspect.getdoc(value) or "").partition("\n\n")[0]
    sentence = re.split(r"(?<=[a-z)\]`²³]\.)\s+(?=[A-Z])", " ".join(text.split()))[0]
    return sentence.replace("|", r"\|")


if __name__ == "__main__":
    print("\n".join(page()))
