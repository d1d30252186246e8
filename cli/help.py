"""`--help`: the options in panels, each command's example at the end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from typer.core import TyperCommand

from cli.show.output import PANELS


class Command(TyperCommand):
    """A command whose help has the options in panels: what, how, output."""

    panels: Mapping[str, str] = {}
    """Heading -> the names of its options; those of no panel stand first."""
    example = ""

    def panels_of(self, ctx: Any) -> dict[str, list[tuple[str, str]]]:
        """Return the rows of help below their headings."""
        rows: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        place: dict[str, str] = {}
        for panels in (self.panels, PANELS):
            for heading, names in panels.items():
                rows.setdefault(heading, [])
                place |= dict.fromkeys(names.split(), heading)
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is not None:
                heading = "Arguments" if param.param_type_name == "argument" else "Options"
                rows[place.get(param.name or "", heading)].append(record)
        return {heading: records for heading, records in rows.items() if records}

    def format_options(self, ctx, formatter) -> None:  # type: ignore[no-untyped-def]
        for heading, records in self.panels_of(ctx).items():
            with formatter.section(heading):
                formatter.write_dl(records)

    def format_epilog(self, ctx, formatter) -> None:  # type: ignore[no-untyped-def]
        if not self.example:
            return
        from cli.examples.command import describe

        with formatter.section(f"Example (dalembert examples {self.example} writes its files here)"):
            formatter.write(f"  {describe(self.example)['command']}\n")


def with_panels(panels: Mapping[str, str], example: str) -> type[Command]:
    """Return the kind of command that has these panels and this example."""
    return type("Command", (Command,), {"panels": panels, "example": example})
