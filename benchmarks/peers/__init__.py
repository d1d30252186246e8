"""The same work with other packages, where they are installed: time and error in the same run.

`requirements.txt` says what to install, into an environment of its own. What is missing is named in one line;
what fails in another package is said and left out. Their methods read `package: how`.
"""

from __future__ import annotations

import contextlib
import io
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec

import numpy as np

from benchmarks.peers import field, in_time, mechanisms, rotation
from benchmarks.speed.measure import Measurement

Peer = Callable[[bool], Iterator[Measurement]]


def measure(domain: str, quick: bool) -> Iterator[Measurement]:
    """Yield what the installed peers of a domain do; name the missing and the failing ones on standard error."""
    missing = []
    for package, work_out in PEERS.get(domain, ()):
        if find_spec(package) is None:
            missing.append(package)
            continue
        try:
            with (
                warnings.catch_warnings(),
                contextlib.redirect_stdout(io.StringIO()),
                np.errstate(all="ignore"),
            ):
                warnings.simplefilter("ignore")
                found = list(work_out(quick))
        except Exception as error:  # a peer's own fault must not end the run
            print(f"{package} failed: {type(error).__name__}: {error}".splitlines()[0], file=sys.stderr)
            continue
        yield from (replace(m, peer=True, method=f"{_named(package)}: {m.method}") for m in found)
    if missing:
        print(
            f"peers not installed, left out: {', '.join(dict.fromkeys(missing))} (see benchmarks/peers/requirements.txt)",
            file=sys.stderr,
        )


def _named(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return package


PEERS: dict[str, tuple[tuple[str, Peer], ...]] = {
    "mechanisms": (
        ("pylinkage", mechanisms.by_pylinkage),
        ("mechanism", mechanisms.by_mechanism),
        ("kinepy", mechanisms.by_kinepy),
        ("mujoco", mechanisms.by_mujoco),
        ("scipy", mechanisms.by_fsolve),
        ("numpy", mechanisms.by_nine_equations),
    ),
    "in-time": (
        ("scipy", in_time.by_scipy),
        ("sksundae", in_time.by_sundials),
        ("exudyn", in_time.by_exudyn),
    ),
    "field": (("hsbalance", field.by_hsbalance),),
    "rotation": (
        ("mujoco", rotation.by_mujoco),
        ("exudyn", rotation.by_exudyn),
        ("pinocchio", rotation.by_pinocchio),
    ),
}
