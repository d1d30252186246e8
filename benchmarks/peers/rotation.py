"""Free rotation by other packages."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.speed.measure import Measurement, measured
from benchmarks.speed.rotation import attitude_error
from benchmarks.truth import reference
from rigidbody3d.attitude import from_matrix

Real = NDArray[np.float64]


def by_mujoco(quick: bool) -> Iterator[Measurement]:
    """Free rotation by MuJoCo's integrators, by steps."""
    mj = import_module("mujoco")
    for body in reference("rotation")["bodies"][: 1 if quick else 2]:
        times = [a["t_s"] for a in body["answers"]]
        true = np.array([a["attitude"] for a in body["answers"]])
        a, b, c = body["inertia"]
        for integrator, steps in (("RK4", (1e-2, 1e-3)), ("Euler", (1e-2, 1e-3)), ("implicit", (1e-2, 1e-3))):
            for step in steps[:1] if quick else steps:
                model = mj.MjModel.from_xml_string(
                    f"<mujoco><option gravity='0 0 0' timestep='{step}' integrator='{integrator}'/>"
                    f"<worldbody><body><freejoint/><inertial pos='0 0 0' mass='1' diaginertia='{a} {b} {c}'/>"
                    f"</body></worldbody></mujoco>"
                )
                call = partial(_mujoco_run, mj, model, body["omega"], times, step)
                yield measured(
                    "rotation",
                    f"attitude to 20 s, {body['name']}",
                    integrator,
                    call,
                    error=attitude_error(call(), true),
                    budget=0.02,
                )


def _mujoco_run(mj: Any, model: Any, omega: Any, times: Any, step: float) -> Real:
    data = mj.MjData(model)
    data.qvel[3:] = omega
    out, done = [], 0
    for time in times:
        count = round(time / step)
        mj.mj_step(model, data, count - done)
        done = count
        out.append(data.qpos[3:].copy())
    return np.array(out)


def by_exudyn(quick: bool) -> Iterator[Measurement]:
    """Free rotation by EXUDYN: explicit Runge-Kutta methods and generalized-α, by steps."""
    exu = import_module("exudyn")
    tools = import_module("exudyn.utilities")
    kind = exu.DynamicSolverType
    solvers = (("RK44", kind.RK44), ("DOPRI5", kind.DOPRI5), ("generalized-α", kind.GeneralizedAlpha))
    for body in reference("rotation")["bodies"][: 1 if quick else 2]:
        times = [a["t_s"] for a in body["answers"]]
        true = np.array([a["attitude"] for a in body["answers"]])
        for name, solver in solvers:
            for step in (1e-2,) if quick else (1e-1, 1e-2, 1e-3):
                call = partial(_exudyn_run, exu, tools, body, times, solver, step)
                yield measured(
                    "rotation",
                    f"attitude to 20 s, {body['name']}",
                    name,
                    call,
                    error=attitude_error(call(), true),
                    budget=0.02,
                )


def _exudyn_run(exu: Any, tools: Any, body: Any, times: Any, solver: Any, step: float) -> Real:
    system = exu.SystemContainer().AddSystem()
    inertia = tools.RigidBodyInertia(mass=1, inertiaTensor=np.diag(body["inertia"]))
    rotor = system.CreateRigidBody(
        inertia=inertia,
        nodeType=exu.NodeType.RotationRotationVector,
        initialAngularVelocity=list(body["omega"]),
    )
    node = system.GetObject(rotor)["nodeNumber"]
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.automaticStepSize = False
    out, start = [], 0.0
    for time in times:
        settings.timeIntegration.startTime, settings.timeIntegration.endTime = start, time
        settings.timeIntegration.numberOfSteps = round((time - start) / step)
        system.SolveDynamic(settings, solverType=solver, updateInitialValues=True)
        start = time
        turned = np.array(system.GetNodeOutput(node, exu.OutputVariableType.RotationMatrix))
        out.append(from_matrix(turned.reshape(3, 3)))
    return np.array(out)


def by_pinocchio(quick: bool) -> Iterator[Measurement]:
    """Free rotation by pinocchio: its forward dynamics (aba), stepped semi-implicitly on the group."""
    pin = import_module("pinocchio")
    for body in reference("rotation")["bodies"][: 1 if quick else 2]:
        times = [a["t_s"] for a in body["answers"]]
        true = np.array([a["attitude"] for a in body["answers"]])
        for step in (1e-2,) if quick else (1e-2, 1e-3):
            call = partial(_pinocchio_run, pin, body, times, step)
            yield measured(
                "rotation",
                f"attitude to 20 s, {body['name']}",
                "aba",
                call,
                error=attitude_error(call(), true),
                budget=0.02,
            )


def _pinocchio_run(pin: Any, body: Any, times: Any, step: float) -> Real:
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    inertia = pin.Inertia(1e-9, np.zeros(3), np.diag(body["inertia"]))
    model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
    model.gravity = pin.Motion.Zero()
    data, still = model.createData(), np.zeros(3)
    q, v, out, done = pin.neutral(model), np.array(body["omega"]), [], 0
    for time in times:
        count = round(time / step)
        for _ in range(count - done):
            v = v + step * pin.aba(model, data, q, v, still)
            q = pin.integrate(model, q, step * v)
        done = count
        out.append(q[[3, 0, 1, 2]] / np.linalg.norm(q))
    return np.array(out)
