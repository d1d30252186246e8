"""The worked solution of `dalembert inspect`: degrees of freedom counted, loops, Grashof's sums of lengths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dalembert.results.way import Topic, figures
from virtualwork.plan.steps import joints, relations
from virtualwork.study.loops import loops

if TYPE_CHECKING:
    from virtualwork import Mechanism


def way(m: Mechanism, check: dict[str, Any]) -> list[Topic]:
    """The topics."""
    n = len(m.links)
    held = sum((len(joint.bodies) - 1) * 2 if joint.guide is None else 1 for joint in joints(m))
    tied = [r for r in relations(m) if r.kind != "input"]
    text = [
        "Each link has three coordinates; a pin of k links takes 2·(k − 1), a slot 1, a slider one more, a gear mesh 1 (Grübler):",
        f"  F = 3·{n} − {held} − {len(tied)} = {3 * n - held - len(tied)}",
    ]
    if check["mobility"] != 3 * n - held - len(tied):
        text.append(f"  the program counts {check['mobility']}")
    if check["mobility_by_rank"] != check["mobility"]:
        text.append(
            f"  by the rank of the Jacobian {check['mobility_by_rank']}: some constraints repeat others"
        )
    head: dict[str, Any] = {
        "links": n, "pins_and_slots": held, "sliders_and_gears": len(tied), "mobility": check["mobility"],
    }  # fmt: skip
    found = [Topic("mobility", text, "Mobility", head)]
    texts = [loop.text for loop in loops(m, m.assembly.plan)]
    if texts:
        found.append(Topic("loops", texts, "Vector loops (Ibrahim, eqs. 1.3.1, 1.3.3)", {"loops": texts}))
    lines = [
        f"  {', '.join(f['links'])}: {f['grashof']}; transmission angle "
        f"{' to '.join('-' if v is None else figures(v) + '°' for v in f['transmission_deg'])}"
        for f in check["four_bars"]
    ]
    if lines:
        text = [
            "A four-bar turns fully where its shortest and longest link together are no longer than the other two (Grashof):"
        ]
        found.append(Topic("four-bars", [*text, *lines], "Four-bars", {"four_bars": check["four_bars"]}))
    return found
