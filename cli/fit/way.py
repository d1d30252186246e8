"""The worked solution of `dalembert fit`: what is minimised, target by target, and the numbers that were found."""

from __future__ import annotations

from typing import Any

from dalembert.results.way import Topic, figures


def way(document: dict[str, Any]) -> list[Topic]:
    """The topics."""
    parameters = document["parameters"]
    text = [
        "Σ weight²·|q(d) − q_target|² over all rows of the target is least over the free dimensions d within their bounds;"
    ]
    text.append(f"each start ends in a local minimum, the least of {document['starts']} starts is taken:")
    text += [f"  {path} = {figures(value)}" for path, value in parameters.items()]
    misses = [
        f"  {each['name']}: "
        + ", ".join(f"{key} = {figures(value)}" for key, value in each.items() if key != "name")
        for each in document["targets"]
    ]
    return [
        Topic("least squares", text, "Least squares", {"parameters": parameters, "starts": document["starts"]}),
        Topic("misses", ["What is left of each target:", *misses], "Distances to the target", {"targets": document["targets"]}),
    ]  # fmt: skip
