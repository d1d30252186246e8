"""The front door: the public names of `balancing`, `virtualwork` and `rigidbody3d`.

>>> import dalembert
>>> dalembert.correct([0.27 + 0.1j], z=[0.02], planes=[0.0]).unbalance.round(2)
array([-0.27-0.1j])
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from balancing import *  # noqa: F403
    from rigidbody3d import *  # noqa: F403
    from virtualwork import *  # noqa: F403

    __version__: str

# asked in this order: who wants a rotor balanced waits for no mechanism
_ROOMS = ("balancing", "virtualwork", "rigidbody3d")


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        value: object = version("dalembert")
    else:
        # `import *` asks for __all__ of this module; no name with an underscore is handed on
        rooms = () if name.startswith("_") else map(import_module, _ROOMS)
        room = next((room for room in rooms if name in room.__all__), None)
        if room is None:
            raise AttributeError(f"module 'dalembert' has no attribute '{name}'")
        value = getattr(room, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    names = {name for room in _ROOMS for name in import_module(room).__all__}
    return sorted({*globals(), "__version__", *names})
