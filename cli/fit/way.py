"""The worked solution of `dalembert fit`: what is minimised, target by target, and the fitted numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from dalembert.results.columns import Table
    from virtualwork import Mechanism
    from virtualwork.family.fitted import Fit


def way(best: Fit[Mechanism], solutions: Table, misses: Table) -> list[Topic]:
    """The topics."""
    parameters = {of.header: of.documented[0] for of in solutions.columns if of.keys[:1] == ("parameters",)}
    text = [
        "Σ weight²·|q(d) − q_target|² over all rows of the target is least over the free dimensions d within their bounds;"
    ]
    text.append(f"each start ends in a local minimum, the least of {best.starts} starts is taken:")
    text += [f"  {path} = {figures(value)}" for path, value in parameters.items()]
    topic = Topic("least squares", text, "Least squares", {"parameters": parameters, "starts": best.starts})
    left = replace(misses, place="targets[]")
    return [topic, Topic("misses", ["What is left of each target:", left], "Distances to the target")]
