"""Frozen data whose fields are mappings: how it is copied and stored."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any


def rebuilt(kind: Callable[..., Any], values: Mapping[str, Any]) -> Any:
    """Make a record again from its fields."""
    return kind(**values)


class Record:
    """Base of frozen dataclasses with frozen mappings: a pickle or a copy holds the fields, and nothing worked out."""

    def __reduce__(self) -> tuple[Any, ...]:
        values = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        return rebuilt, (type(self), {k: dict(v) if isinstance(v, Mapping) else v for k, v in values.items()})
