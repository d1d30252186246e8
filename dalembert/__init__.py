"""The public names of `balancing`, `virtualwork` and `rigidbody3d` in one namespace; each is loaded at its first use.

>>> import dalembert
>>> dalembert.correct([0.27 + 0.1j], z=[0.02], planes=[0.0]).unbalance.round(2)
array([-0.27-0.1j])

A name that says too little without its package is longer here: `rigidbody3d.check` is `dalembert.check_inertia`.
docs/library.md has the first sentence of each; `help(dalembert.correct)` shows all of one.

Rotors (`balancing`):
    AmplitudeFit, Balance, CoincidentPlanes, Correction, DependentPlanes, DependentTrials,
    Drift, ErrorBudget, FewestWeights, GRADES, Indexed, Infeasible, JointFit, LogBalance,
    ModalCorrection, NextRun, NotConverged, OncePerTurn, Placement, Prior, TorqueCycle, TrialEffect,
    Unbalances, Undetermined, UnreachedMode, ZONE_BOUNDARIES, allocate_tolerance, api_unbalance,
    condition_number, correct, determined_channels, drift_test, drill_depth, error_budget,
    fewest_from_stock, fit_with_prior, grade_value, groups_by_size, index_balancing,
    influence_coefficients, influence_error, influence_from_amplitudes, initial_alone,
    initial_unbalance, joint_fit, journal_loads, least_squares, mil_unbalance, minimax,
    modal_corrections, once_per_turn, outlier_probability, permissible_unbalance, phase_sense,
    place_from_stock, place_masses, place_weights, plane_significance, pooled_prior, read_runs, region_factor,
    repeated_readings, robust_fit, severity_zone, shapes_at, spread_of_corrections, stored_prior,
    suggest_run, torque_cycle, transfer_to_planes, trial_effect, trial_unbalance, unseen_combination

Mechanisms (`virtualwork`):
    AssemblyError, Belt, Bound, Cam, Check, Cycle, DescriptionError, Equilibria, Equilibrium, Force, Friction, GROUND,
    Gear, Guess, Guide, ImportedMechanism, Input, Link, LinkStates, Mechanism, MechanismError, MobilityError, Motion,
    Motor, Polar, Rack, Segment, Spring, Target, Torque, TorsionSpring, UnitLoad, balance_virtual_power, block_on_bar,
    counterweights, crank_rod_piston, direction_angle, export_mechanism, grashof_class, import_mechanisms, newton, on_incline,
    on_moving_ramp, rotation_of_point, second_point, work_ledger

Bodies (`rigidbody3d`):
    Body, BodyMotion, FreeBody, FreeState, Robot, SHAPES, Shaft, Top, TopState, Trajectory, Wrench,
    check_inertia, check_robot_inertias, compose_body, from_scipy, gyroscopic_couple, inertia_of, inertia_tensor,
    integrate_rotation, link_body, load_mesh, measure_of, mesh_properties, parallel_axis_shift, principal_axes,
    products_of_inertia, read_parts, read_robot, rolling_cones, sleeping_threshold, steady_precession, strike_body, to_scipy
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from balancing import *  # noqa: F403
    from rigidbody3d import *  # noqa: F403
    from virtualwork import *  # type: ignore[assignment]  # noqa: F403

    __version__: str

# in the order of search: a rotor waits for no mechanism; names that say too little without their package, by their name here
_ROOMS: dict[str, dict[str, str]] = {
    "balancing": {
        "allocate_tolerance": "allocate",
        "groups_by_size": "by_size",
        "determined_channels": "determined",
        "drift_test": "drift",
        "place_masses": "place",
        "repeated_readings": "repeats",
        "spread_of_corrections": "spread",
        "transfer_to_planes": "transfer",
        "unseen_combination": "unseen",
    },
    "virtualwork": {
        "balance_virtual_power": "balance",
        "work_ledger": "ledger",
        "rotation_of_point": "rotation",
        "direction_angle": "sense",
    },
    "rigidbody3d": {
        "BodyMotion": "Motion",
        "check_inertia": "check",
        "compose_body": "compose",
        "rolling_cones": "cones",
        "integrate_rotation": "integrate",
        "mesh_properties": "mesh",
        "principal_axes": "principal",
        "products_of_inertia": "products",
        "parallel_axis_shift": "shift",
        "strike_body": "strike",
        "inertia_tensor": "tensor",
    },
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("dalembert")
    else:
        value = _of_a_package(name)
    globals()[name] = value
    return value


def _of_a_package(name: str) -> Any:
    hint = ""
    # `import *` asks for __all__; a name with an underscore is none of the library's
    for room, nouns in _ROOMS.items() if not name.startswith("_") else ():
        names = import_module(room).__all__
        if name in nouns or (name in names and name not in nouns.values()):
            return getattr(import_module(room), nouns.get(name, name))
        hint = next((f": it is `dalembert.{n}` or `{room}.{name}`" for n in nouns if nouns[n] == name), hint)
    raise AttributeError(f"module 'dalembert' has no attribute '{name}'{hint}")


def __dir__() -> list[str]:
    names = {"__version__", *(name for name in globals() if name.startswith("__"))}
    for room, nouns in _ROOMS.items():
        names |= {*nouns, *(set(import_module(room).__all__) - {*nouns.values()})}
    return sorted(names)
