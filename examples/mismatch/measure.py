"""The laboratory of the worked example: writes the records that the nominal model cannot explain.

Plain MuJoCo, no bench: the table is a little heavier than drawn, its spring a little softer, and two buffers that stand in no
drawing touch it beyond 3 mm on either side. Run it as ``python measure.py FOLDER``; the folder then holds a complete case.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).parent
SAMPLE_RATE = 500.0
SAMPLES = 3000
STEPS_A_SAMPLE = 20
BUFFER_STIFFNESS, CLEARANCE = 1200.0, 0.003
NOISE = {"displacement": 5e-5, "acceleration": 0.05}


def shaker_force(rng: np.random.Generator) -> np.ndarray:
    """Random force between 0.5 and 12 Hz, rising from zero [N]."""
    spectrum = np.fft.rfft(rng.standard_normal(SAMPLES))
    frequency = np.fft.rfftfreq(SAMPLES, 1.0 / SAMPLE_RATE)
    spectrum[(frequency < 0.5) | (frequency > 12.0)] = 0.0
    force = np.fft.irfft(spectrum, SAMPLES) * np.minimum(np.arange(SAMPLES) / 100.0, 1.0)
    return 5.0 * force / np.std(force)


def run(force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [m] and acceleration [m/s^2] of the real table."""
    model = mujoco.MjModel.from_xml_path(str(HERE / "stage.xml"))
    model.opt.timestep = 1.0 / (SAMPLE_RATE * STEPS_A_SAMPLE)
    model.body("table").mass = 2.42
    model.joint("guide").stiffness = 1470.0
    model.joint("guide").damping = 6.6
    mujoco.mj_setConst(model, mujoco.MjData(model))
    data = mujoco.MjData(model)
    displacement, acceleration = np.zeros(SAMPLES), np.zeros(SAMPLES)
    fine = np.interp(np.arange(SAMPLES * STEPS_A_SAMPLE) / STEPS_A_SAMPLE, np.arange(SAMPLES), force)
    for k, load in enumerate(fine):
        x = data.qpos[0]
        data.ctrl[0] = load
        data.qfrc_applied[0] = -BUFFER_STIFFNESS * np.sign(x) * max(abs(x) - CLEARANCE, 0.0)
        if k % STEPS_A_SAMPLE == 0:
            mujoco.mj_forward(model, data)
            displacement[k // STEPS_A_SAMPLE], acceleration[k // STEPS_A_SAMPLE] = x, data.qacc[0]
        mujoco.mj_step(model, data)
    return displacement, acceleration


def measure(folder: str | Path) -> Path:
    """Write the case: the nominal model, what is believed of it, and two records."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("stage.xml", "nominal.json"):
        shutil.copy(HERE / name, folder / name)
    rng = np.random.default_rng(1)
    time = np.arange(SAMPLES) / SAMPLE_RATE
    for name in ("identification", "validation"):
        force = shaker_force(rng)
        displacement, acceleration = run(force)
        displacement = displacement + NOISE["displacement"] * rng.standard_normal(SAMPLES)
        acceleration = acceleration + NOISE["acceleration"] * rng.standard_normal(SAMPLES)
        np.savetxt(
            folder / f"{name}.csv",
            np.column_stack([time, force, displacement, acceleration]),
            delimiter=",",
            header="time,force,displacement,acceleration",
            comments="",
            fmt="%.7g",
        )
    return folder


if __name__ == "__main__":
    print(measure(sys.argv[1] if len(sys.argv) > 1 else "my-stage"))
