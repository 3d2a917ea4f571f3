"""The laboratory of the arm: logs of commands and encoders that the nominal model does not explain.

Plain MuJoCo, no bench: all numbers are a little off the drawing, and the gear of the elbow has dry friction, hard, at a tenth of
the model's step. Run it as ``python measure.py FOLDER``; the folder then holds a complete case.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).parent
RATE = 100.0
SECONDS = 12.0
STEP = 1e-4
FRICTION = 0.35  # N m, at the elbow
NOISE = 5e-4  # rad
JOINTS = ("shoulder", "elbow", "wrist")
SWING = (0.55, 0.8, 0.7)  # rad
OFF = {
    "mass": (1.012, 0.99, 1.015),
    "damping": (1.1, 0.92, 1.08),
    "armature": (0.97, 1.05, 1.02),
    "kp": (1.02, 0.97, 1.01),
}


def goals(rng: np.random.Generator) -> np.ndarray:
    """Targets of the servos (n, 3) [rad]: five slow sines in each joint, held between samples, rising from rest."""
    time = np.arange(round(SECONDS * RATE)) / RATE
    columns = []
    for swing in SWING:
        frequency, phase = rng.uniform(0.15, 1.2, 5), rng.uniform(0.0, 2 * np.pi, 5)
        wave = np.sin(2 * np.pi * np.outer(time, frequency) + phase) @ (0.3 / np.sqrt(frequency))
        columns.append(swing * (wave - wave[0]) * np.minimum(time, 1.0))
    return np.column_stack(columns)


def laboratory() -> mujoco.MjModel:
    """The real arm."""
    model = mujoco.MjModel.from_xml_path(str(HERE / "arm.xml"))
    model.opt.timestep, model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for k, joint in enumerate(JOINTS):
        model.body_mass[k + 1] *= OFF["mass"][k]
        model.dof_damping[k] *= OFF["damping"][k]
        model.dof_armature[k] *= OFF["armature"][k]
        gain = model.actuator(f"{joint}_servo")
        gain.gainprm[0] *= OFF["kp"][k]
        gain.biasprm[1] *= OFF["kp"][k]
    elbow = model.joint("elbow").dofadr[0]
    model.dof_frictionloss[elbow] = FRICTION
    model.dof_solref[elbow] = (2 * STEP, 1.0)
    model.dof_solimp[elbow, :3] = (0.99, 0.999, 1e-6)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def run(targets: np.ndarray) -> np.ndarray:
    """Angles of the joints (n, 3) [rad] at the samples."""
    model = laboratory()
    data = mujoco.MjData(model)
    angles = np.zeros_like(targets)
    for k, target in enumerate(targets):
        angles[k] = data.qpos
        data.ctrl[:] = target
        mujoco.mj_step(model, data, nstep=round(1.0 / (RATE * STEP)))
    return angles


def measure(folder: str | Path) -> Path:
    """Write the case: the nominal model, what is believed of it, and three records."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("arm.xml", "nominal.json"):
        shutil.copy(HERE / name, folder / name)
    for seed, name in enumerate(("identification", "identification_2", "validation"), start=1):
        rng = np.random.default_rng(seed)
        targets = goals(rng)
        angles = run(targets) + NOISE * rng.standard_normal(targets.shape)
        table = np.column_stack([np.arange(len(targets)) / RATE, targets, angles])
        header = ",".join(["time", *(f"{j}_goal" for j in JOINTS), *(f"{j}_angle" for j in JOINTS)])
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.8g")
    return folder


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python measure.py FOLDER")
    print(measure(sys.argv[1]))
