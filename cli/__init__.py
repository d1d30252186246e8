"""The `dalembert` command: reads tables, calls the three packages, shows the result."""

import os

COMPLETE = "_DALEMBERT_COMPLETE"
"""The environment variable by which a shell asks for completions."""


def completed_words() -> list[str]:
    """Return the words so far of the command line that a shell completes."""
    return (os.environ.get("COMP_WORDS") or os.environ.get("_TYPER_COMPLETE_ARGS") or "").split()
