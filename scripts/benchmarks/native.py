"""Native callbacks against the same model without callbacks, and against a Python callback."""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np
from mujoco import rollout
from mujoco.batch import Batch

from bench import Element, joint_rig, native, sdof_rig
from bench.rig import Rig
from benchmarks.timing import Row, interleave, ratio_row

STEPS = 20_000
_DECK = (
    35025.4,
    1106.8,
    315228.2,
    87563.4,
    22.597,
    0.71406,
    203.37,
    2224.1,
    0.00508,
    0.2,
)  # SI, rounded: a load, not a model
N_BATCH = 64


def _rig(integrator: str) -> Rig:
    gap = Element.of("gap", "carriage", stiffness=3000.0, clearance=0.003)
    hysteresis = Element.of("bouc_wen", "carriage", A=800.0, beta=60.0, gamma=40.0, n=1.0)
    return sdof_rig(gap, hysteresis, mass=2.0, stiffness=1500.0, damping=4.0, integrator=integrator)


def _loop(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    data.qvel[0] = 0.3
    for _ in range(STEPS):
        mujoco.mj_step(model, data)


def _rollout(model: mujoco.MjModel) -> None:
    data = [mujoco.MjData(model) for _ in range(2)]
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    rollout.rollout(model, data, np.zeros((8, size)), nstep=STEPS // 4)


def _batch(model: mujoco.MjModel) -> None:
    batch = Batch(model, N_BATCH, 2)
    batch.bind("qvel")[:] = 0.3
    batch.step(nstep=STEPS // 16)


def _numpy_passive(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """The gap and the Bouc-Wen force of `_rig`, as they stand in a paper: with NumPy's functions."""
    q = data.qpos[0]
    force = 3000.0 * np.sign(q) * np.maximum(np.abs(q) - 0.003, 0.0)
    if model.na:
        force += data.act[0]
    data.qfrc_passive[0] -= force


def _numpy_act_dyn(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> float:
    v, z = data.qvel[0], data.act[0]
    return 800.0 * v - 60.0 * np.abs(v) * z - 40.0 * v * np.abs(z)


def _scalar_passive(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """The same with as little work as Python allows."""
    q = data.qpos[0]
    engaged = abs(q) - 0.003
    force = data.act[0] if model.na else 0.0
    if engaged > 0.0:
        force += math.copysign(3000.0 * engaged, q)
    data.qfrc_passive[0] -= force


def _scalar_joint(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """The deck's joint law between the two bodies, with as little work as Python allows."""
    k, c, k_gap, c_c, kt, ct, kt_gap, ct_c, clearance_x, clearance_t = _DECK
    x, t = data.qpos[2] - data.qpos[0], data.qpos[3] - data.qpos[1]
    v, w = data.qvel[2] - data.qvel[0], data.qvel[3] - data.qvel[1]
    dx, dt = max(abs(x) - clearance_x, 0.0), max(abs(t) - clearance_t, 0.0)
    force = k * x + c * v + math.copysign(k_gap * dx, x) + c_c * v * dt
    torque = kt * t + ct * w + math.copysign(kt_gap * dt, t) + ct_c * w * dx
    data.qfrc_passive[0] += force
    data.qfrc_passive[1] += torque
    data.qfrc_passive[2] -= force
    data.qfrc_passive[3] -= torque


def _scalar_act_dyn(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> float:
    v, z = data.qvel[0], data.act[0]
    return 800.0 * v - 60.0 * abs(v) * z - 40.0 * v * abs(z)


def _without(task, model: mujoco.MjModel):
    def run() -> None:
        native.uninstall()
        try:
            task(model)
        finally:
            native.install()

    return run


def rows(repeats: int = 15) -> list[Row]:
    """Rows of the group."""
    result = []
    for integrator in ("RK4", "Euler"):
        for label, task in (("loop", _loop), ("rollout, 2 threads", _rollout), ("Batch, 2 threads", _batch)):
            for name, rig in (
                ("SDOF gap + Bouc-Wen", _rig(integrator)),
                ("deck joint", joint_rig(integrator=integrator)),
            ):
                model = rig.model
                seconds = interleave(
                    {"with": lambda t=task, m=model: t(m), "without": _without(task, model)}, repeats
                )
                result.append(
                    ratio_row(
                        f"{name}, {integrator}, {label}",
                        seconds["with"],
                        seconds["without"],
                        limit="≥ 0.95",
                        meaning="step rate with native callback / without any callback, same model",
                    )
                )
    gap = Element.of("gap", "carriage", stiffness=3000.0, clearance=0.003)
    plain, both = sdof_rig(gap, mass=2.0, stiffness=1500.0, damping=4.0), _rig("RK4")
    for name, rig, callbacks, limit in (
        ("SDOF gap, NumPy functions", plain, (_numpy_passive, _numpy_act_dyn), ""),
        ("SDOF gap, scalar arithmetic", plain, (_scalar_passive, _scalar_act_dyn), ""),
        ("SDOF gap + Bouc-Wen, NumPy functions", both, (_numpy_passive, _numpy_act_dyn), "≥ 3"),
        ("SDOF gap + Bouc-Wen, scalar arithmetic", both, (_scalar_passive, _scalar_act_dyn), ""),
        ("deck joint, scalar arithmetic", joint_rig(), (_scalar_joint, _scalar_act_dyn), "≥ 3"),
    ):
        result.append(_against_python(name, rig, callbacks, limit, repeats))
    return result


def _against_python(
    name: str, rig: Rig, callbacks: tuple[Callable[..., None], Callable[..., float]], limit: str, repeats: int
) -> Row:
    """What a single gap, or scalar arithmetic, costs in Python is the least there is: reported, without a limit."""
    model = rig.model
    passive, act_dyn = callbacks

    def python() -> None:
        native.uninstall()
        mujoco.set_mjcb_passive(passive)
        mujoco.set_mjcb_act_dyn(act_dyn)
        try:
            _loop(model)
        finally:
            mujoco.set_mjcb_passive(None)
            mujoco.set_mjcb_act_dyn(None)
            native.install()

    seconds = interleave({"native": lambda: _loop(model), "python": python}, max(5, repeats // 3))
    return ratio_row(
        f"{name}: RK4, loop, native against Python callback",
        seconds["native"],
        seconds["python"],
        limit=limit,
        meaning="step rate with native callback / with a Python callback",
    )
