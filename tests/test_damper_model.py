"""The damper rig prescribes its motion: the servo follows, whatever the damper does."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from bench import model_path

Motion = Callable[[float], tuple[float, float, float]]


def multisine(amplitude: float, frequencies: NDArray[np.float64], phases: NDArray[np.float64]) -> Motion:
    omega = 2.0 * np.pi * frequencies
    grid = np.sin(np.outer(np.arange(0.0, 8.0, 1e-3), omega) + phases).sum(axis=1)
    scale = amplitude / np.abs(grid).max()

    def motion(time: float) -> tuple[float, float, float]:
        sine, cosine = np.sin(omega * time + phases), np.cos(omega * time + phases)
        return scale * sine.sum(), scale * (omega * cosine).sum(), -scale * (omega**2 * sine).sum()

    return motion


@pytest.mark.parametrize("load_case", ["none", "constant", "friction"])
@pytest.mark.parametrize(
    ("stroke", "lines"),
    [(0.02, [1.0]), (0.15, [2.5]), (0.025, np.arange(1, 65) / 8.0)],
    ids=["1Hz", "2.5Hz", "random"],
)
def test_damper_motion_is_prescribed(
    stroke: float, lines: NDArray, load_case: str, rng: np.random.Generator
) -> None:
    """Sines and an 8 Hz random record are followed to 1e-4 of the stroke, whatever 40 kN do."""
    model = mujoco.MjModel.from_xml_path(str(model_path("damper")))
    data = mujoco.MjData(model)
    step = model.opt.timestep
    assert step == 1.0 / 1024.0
    effective = model.dof_M0[0]
    lines = np.asarray(lines)
    motion = multisine(stroke, lines, rng.uniform(0.0, 2.0 * np.pi, len(lines)))
    data.qpos[0], data.qvel[0], _ = motion(0.0)
    worst = 0.0
    for i in range(2048):
        position, velocity, acceleration = motion((i + 0.5) * step)
        data.ctrl[:] = [position, velocity, effective * acceleration]
        sign = np.sign(data.qvel[0]) if load_case == "friction" else 1.0
        data.qfrc_applied[0] = 0.0 if load_case == "none" else -40e3 * sign
        mujoco.mj_step(model, data)
        worst = max(worst, abs(data.qpos[0] - motion((i + 1) * step)[0]))
    assert worst < 1e-4 * stroke


def test_damper_mass_is_the_feed_forwards() -> None:
    model = mujoco.MjModel.from_xml_path(str(model_path("damper")))
    assert model.dof_M0[0] == pytest.approx(1e7, rel=1e-12)
    omega = 2.0 * np.pi * 15.0
    # 1e-12: decimals of the file.
    assert model.actuator("drive_position").gainprm[0] == pytest.approx(1e7 * omega**2, rel=1e-12)
    assert model.actuator("drive_velocity").gainprm[0] == pytest.approx(2.0 * 0.7 * omega * 1e7, rel=1e-12)
