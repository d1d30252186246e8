"""Which engine the environment wants: `DALEMBERT_ENGINE`, or none."""

from __future__ import annotations

import os

ENGINES = ("python", "numpy", "llvm")


class EngineError(ValueError):
    """An engine that there is not."""


def checked(engine: str) -> str:
    """Return the name of an engine.

    Raises
    ------
    EngineError
        Where there is none of that name.
    """
    if engine not in ENGINES:
        raise EngineError(f"engine '{engine}': expected {', '.join(ENGINES)}")
    return engine


def wanted() -> str | None:
    """Return the engine that the environment wants; None where the size of the work decides.

    Raises
    ------
    EngineError
        Where there is none of that name.
    """
    engine = os.environ.get("DALEMBERT_ENGINE")
    if not engine:
        return None
    if engine not in ENGINES:
        raise EngineError(
            f"DALEMBERT_ENGINE={engine}: there is no such engine: expected {', '.join(ENGINES)}, or nothing"
        )
    return engine
