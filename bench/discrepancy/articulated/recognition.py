"""Which cases are for the engine of articulated models."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from bench import native
from bench.discrepancy.case.case import Case
from bench.discrepancy.model.mjcf_file import rig_of
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.encoders import encoders_of
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.nominal_parameters import nominal_parameters
from bench.discrepancy.settings import DEFAULT, ArticulatedSettings
from bench.errors import BenchError
from bench.rig.actuators import DRIVES, commanded


def applies(case: Case, *, settings: ArticulatedSettings = DEFAULT.articulated) -> bool:
    """Whether the rig of a case is an MJCF of several joints with servos, parameters of drives, or inertia that changes with posture, or
    one whose joints, each measured and driven on its own, no linear structure describes."""
    path = Path(case.folder or ".") / case.rig
    if case.rig in ("sdof", "joint", "damper") or not path.is_file():
        return False
    if any(p.name.partition(":")[0] in DRIVES for p in case.parameters):
        return True
    try:
        model = rig_of(case).model
    except BenchError:
        return False  # refused where the model is read for a diagnosis
    # one joint on its own is a linear structure first: forces on it have a larger catalogue there
    servos = model.nv > 1 and any(commanded(model, u) == "position" for u in range(model.nu))
    return servos or _posture_matters(model, settings=settings) or (_bends(model) and drives_only(case))


def drives_only(case: Case) -> bool:
    """Whether every joint of the rig of a case, an MJCF, is measured and driven on its own, so that this engine can be asked, too."""
    path = Path(case.folder or ".") / case.rig
    if case.rig in ("sdof", "joint", "damper") or not path.is_file():
        return False
    try:
        compiled = rig_of(case).model
        model, own = ArticulatedModel.of(compiled), bound(case, compiled)
        for joint in model.joints:
            encoders_of(own, joint)
            input_of(own, joint)
        nominal_parameters(own, model)
    except BenchError:
        return False
    return True


def _bends(model: mujoco.MjModel) -> bool:
    """Whether drives have a past, springs or dampers are polynomials, or what moves is in a medium."""
    curved = (model.jnt_stiffnesspoly, model.dof_dampingpoly, model.actuator_dampingpoly)
    medium = model.opt.density > 0.0 or model.opt.viscosity > 0.0
    return bool(model.na or model.nhistory or medium or any(np.any(coefficients) for coefficients in curved))


@native.quiet()
def _posture_matters(model: mujoco.MjModel, *, settings: ArticulatedSettings) -> bool:
    if model.nv != model.njnt or model.nv < 2:
        return False
    rng = np.random.default_rng(0)
    data, matrices = mujoco.MjData(model), []
    for _ in range(settings.postures):
        data.qpos[:] = model.qpos0 + rng.uniform(-1.0, 1.0, model.nq)
        mujoco.mj_forward(model, data)
        matrices.append(np.array(data.M))
    spread = np.ptp(matrices, axis=0)
    return bool(np.max(spread) > 1e-6 * np.max(np.abs(matrices)))
