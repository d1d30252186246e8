"""Names of a package whose modules are loaded when one of their names is used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def on_use(
    namespace: dict[str, Any], homes: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package.

    Parameters
    ----------
    namespace : dict
        Its `globals()`.
    homes : mapping
        Module -> the names that stand in it, or are modules of it, between blanks.

    Examples
    --------
    >>> import sys, types
    >>> package = types.ModuleType("package")
    >>> package.__getattr__, package.__dir__ = on_use(vars(package), {"math": "pi tau", "os": "path"})
    >>> package.tau == 2 * package.pi, package.path is sys.modules["os.path"]
    (True, True)
    >>> package.e
    Traceback (most recent call last):
    AttributeError: module 'package' has no attribute 'e'
    """
    package = namespace["__name__"]
    home = {name: module for module, names in homes.items() for name in names.split()}

    def attribute(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        module = import_module(home[name])
        value = getattr(module, name, None)
        namespace[name] = import_module(f"{home[name]}.{name}") if value is None else value
        return namespace[name]

    return attribute, lambda: sorted({*namespace, *home})
