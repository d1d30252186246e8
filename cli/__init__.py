"""The `dalembert` command: reads tables, calls the three packages, shows the result. Here: its commands by their names."""

import os
from collections.abc import Callable
from importlib import import_module

# heading -> name -> (the function, by its module, and the line shown by `dalembert --help`)
GROUPS = {
    "Rotors": {
        "balance": ("cli.balance.run", "Balance rotors from a table of known eccentric masses."),
        "field": ("cli.field.run", "Balance rotors from measured vibration and trial masses."),
        "trial": ("cli.rotor.trial", "Suggest a trial mass for the first run in the field."),
        "signal": ("cli.rotor.signal", "Compute amplitude and phase of a recorded vibration."),
        "place": (
            "cli.rotor.place",
            "Put a correction where masses can go: holes, blades, weights in stock.",
        ),
        "index": ("cli.rotor.index", "Separate a rotor's unbalance from its mandrel's: index balancing."),
        "engine": ("cli.rotor.engine", "Compute the shaking forces and couples of an engine."),
        "flywheel": ("cli.rotor.flywheel", "Size the flywheel of a shaft from a table of its torque."),
    },
    "Mechanisms": {
        "mechanism": ("cli.mechanism.mechanism", "Solve the poses: positions, velocities, accelerations."),
        "forces": (
            "cli.mechanism.forces",
            "Compute the effort at the inputs, joint forces, the shaking force.",
        ),
        "inspect": (
            "cli.mechanism.inspect",
            "Inspect mobility, Grashof classes, limits, dead and change points, strokes.",
        ),
        "equilibrium": (
            "cli.mechanism.equilibrium",
            "Find the positions of rest, their stability and periods of oscillation.",
        ),
        "simulate": ("cli.mechanism.simulate", "Simulate the motion in time under the loads."),
        "tolerance": ("cli.mechanism.tolerance", "Compute the effect of the tolerances of dimensions."),
        "fit": ("cli.mechanism.fit", "Fit dimensions to a target."),
        "work": (
            "cli.mechanism.work",
            "Find the load that balances a table of link states, by virtual work.",
        ),
    },
    "Bodies": {
        "body": ("cli.body.body", "Compute inertia, angular momentum and shaft reactions of a body."),
        "spin": (
            "cli.body.spin",
            "Compute the rotation of a body in time: free, under gravity, under a torque.",
        ),
    },
    "Teaching": {
        "exercise": (
            "cli.exercise.exercise",
            "Make the variants of an exercise: sheets, key, solutions, questions.",
        ),
        "grade": ("cli.exercise.grade", "Mark the answers to an exercise, and name likely mistakes."),
    },
    "Files": {
        "import": ("cli.formats.run", "Import a mechanism drawn in another program."),
        "export": (
            "cli.formats.export_command.run",
            "Write a mechanism for other programs: DXF, SVG, CSV, URDF, SDF, MJCF.",
        ),
        "examples": (
            "cli.examples.run",
            "List the worked examples, or write one into the current folder.",
        ),
        "completion": ("cli.completion.run", "Print the completion script for bash, zsh or fish."),
    },
}
COMMANDS = {name: line for group in GROUPS.values() for name, line in group.items()}


def function_of(command: str) -> Callable[..., None]:
    """Return the function of a command; the file of no other command is loaded."""
    module, _, name = COMMANDS[command][0].rpartition(".")
    function: Callable[..., None] = getattr(import_module(module), name)
    return function


COMPLETE = "_DALEMBERT_COMPLETE"
"""The environment variable by which a shell asks for completions."""


def completed_words() -> list[str]:
    """Return the words so far of the command line that a shell completes."""
    return (os.environ.get("COMP_WORDS") or os.environ.get("_TYPER_COMPLETE_ARGS") or "").split()
