"""`dalembert completion`: the script that lets a shell complete commands and options."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer
from typer.completion import get_completion_script  # type: ignore[attr-defined]

VARIABLE = "_DALEMBERT_COMPLETE"
"""The shell asks through this environment variable."""
NAMES = """
# NAME=VALUE is one word, and no blank follows NAME=
COMP_WORDBREAKS=${COMP_WORDBREAKS//=/}
"""


class Shell(StrEnum):
    """The shells that are known."""

    bash = "bash"
    zsh = "zsh"
    fish = "fish"


def run(shell: Annotated[Shell, typer.Argument(help="The shell that reads the script.")]) -> None:
    """Print the completion script of a shell: source <(dalembert completion bash), in fish dalembert completion fish | source."""
    script = get_completion_script(prog_name="dalembert", complete_var=VARIABLE, shell=shell.value)
    if shell is Shell.bash:
        ends = "    [[ ${COMPREPLY[0]} == *= ]] && compopt -o nospace 2>/dev/null\n    return 0\n"
        script = script.replace("    return 0\n", ends) + NAMES
    typer.echo(script)
