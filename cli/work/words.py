"""The ledger of virtual power in words, above the terminal's table."""

from __future__ import annotations

from cli.show.text import table_text
from cli.work.solve import WorkBalance

SHOWN_STEPS = 3  # up to so many steps the terminal shows each term


def notes(found: WorkBalance) -> str:
    """Say what each term does."""
    steps = found.states.steps
    if len(steps) > SHOWN_STEPS:
        return f"{len(steps)} steps; --ledger shows the power of every term\n\nunknowns:"
    parts = []
    for index, step in enumerate(steps):
        terms = list(found.terms(index))
        kept = [term for term in terms if term.power is not None]
        ledger = {"field": [term.field for term in kept]} if len(step.fields) > 1 else {}
        ledger |= {"link": [term.link for term in kept], "kind": [term.kind for term in kept]}
        workless = [f"{term.link}: {term.kind}" for term in terms if term.power is None]
        title = f"step {step.name}: virtual power" if len(steps) > 1 else "virtual power"
        parts.append(
            f"{title}\n{table_text({**ledger, 'power_W': [term.power for term in kept]})}"
            f"sum {', '.join(f'{value:.3g}' for value in found.sums(index))} W"
            + (f"\ndo no work: {', '.join(workless)}" if workless else "")
        )
    return "\n\n".join([*parts, "unknowns:"])
