"""Run time against error, one module per domain.

A domain's module has a function `measure(quick: bool)` that yields `Measurement`s. Errors are against answers of
extended precision or rational arithmetic (`benchmarks.truth`); never against the program itself.
"""

# domain -> (module with a function `measure`, what it measures)
DOMAINS = {
    "mechanisms": ("benchmarks.speed.mechanisms", "mechanisms in motion, their torque and joint forces"),
    "evaluators": ("benchmarks.speed.evaluators", "the tape: evaluators on each engine, beside C"),
    "in-time": ("benchmarks.speed.in_time", "motion under forces, beside other integrators"),
    "variants": (
        "benchmarks.speed.variants",
        "families of mechanisms, beside a loop and beside poses of one",
    ),
    "skipping": ("benchmarks.speed.skipping", "what smaller requests save"),
    "rotors": ("benchmarks.speed.rotors", "corrections of rotors with known masses"),
    "field": ("benchmarks.speed.field", "corrections from measured vibration"),
    "bodies": ("benchmarks.speed.bodies", "angular momentum, its rate and inertia forces of rigid bodies"),
    "rotation": ("benchmarks.speed.rotation", "free rotation in closed form and integrated"),
    "commands": ("benchmarks.speed.commands", "whole commands from start to end"),
}
