"""The ledger of virtual power in words, above the terminal's table."""

from __future__ import annotations

from cli.show.columns import Section
from cli.show.text import table_text
from cli.work import columns
from cli.work.solve import WorkBalance

METHOD = (
    "Virtual power: the applied forces and the inertia forces −m·a, −I·α together do no work on the given velocities "
    "(d'Alembert and Lagrange; J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 1–5)."
)

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


def sections(found: WorkBalance) -> list[Section]:
    """The unknowns and the power of every term, for the report."""
    sums = [f"{value:.3g} W" for i in range(len(found.states.steps)) for value in found.sums(i)]
    kept = (
        "The terms add up to " + ", ".join(sums[:SHOWN_STEPS]) + ("." if len(sums) <= SHOWN_STEPS else " …")
    )
    return [
        Section("Unknowns", [columns.unknowns(found)]),
        Section("Power of every term", [columns.ledger(found), kept]),
    ]
