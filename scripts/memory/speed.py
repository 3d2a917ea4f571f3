"""What a learned joint with memory costs in MuJoCo's callback: the step rate with it over that of the same model without callbacks."""

from __future__ import annotations

import mujoco
import numpy as np
from benchmarks.timing import interleave
from scipy.stats import bootstrap

from bench import native
from bench.identification.memory import fit_memory
from bench.reproduction import laboratory
from bench.reproduction.joint_models import LOADINGS
from bench.rig import Element, simulate
from memory.row import Progress, Row

STEPS, REPEATS = 1_000, 301
"""Short pairs, many of them: what else the machine does in bursts meets few pairs, and their median is that of the others."""
LIMIT = 0.9
"""Least ratio of the step rates."""


def _loop(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    data.qvel[:2] = 0.3, 3.0
    for _ in range(STEPS):
        mujoco.mj_step(model, data)


def _without(model: mujoco.MjModel) -> None:
    native.uninstall()
    try:
        _loop(model)
    finally:
        native.install()


def rows(progress: Progress) -> list[Row]:
    """Rows of the task."""
    progress("learning a joint")
    rig, rng = laboratory.rig_with_friction(), np.random.default_rng(70)
    records = [
        laboratory.measured(
            simulate(rig, laboratory.drive(loaded), rng=np.random.default_rng(laboratory.SETUP.seeds[name])),
            rng,
        )
        for name, loaded in LOADINGS.items()
    ]
    data = laboratory.view(*records)
    assert data.time is not None
    found = []
    for label, form in (("memory, sliders", "sliders"), ("memory, profiles", "profiles")):
        model = fit_memory(data.states, data.forces, time=data.time, form=form)
        element = Element(model.law, laboratory.AXES, model.theta, name="joint")
        for integrator in ("RK4", "implicitfast"):
            compiled = laboratory.rig().with_(elements=(element,), integrator=integrator).model
            progress(f"{label}, {integrator}")
            seconds = interleave(
                {"with": lambda m=compiled: _loop(m), "without": lambda m=compiled: _without(m)}, REPEATS
            )
            ratios = seconds["without"] / seconds["with"]
            interval = bootstrap((ratios,), np.median, rng=np.random.default_rng(0)).confidence_interval
            note = (
                f"{interval.low:.3f} to {interval.high:.3f}; "
                f"{model.report.n_parameters} parameters, {model.report.n_states} states"
            )
            quantity = f"step rate over that without callbacks, laboratory rig, {integrator}"
            found.append(
                Row("speed", label, quantity, float(np.median(ratios)), "1", LIMIT, least=True, note=note)
            )
    return found
