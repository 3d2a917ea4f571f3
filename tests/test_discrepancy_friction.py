"""Friction that creeps: MuJoCo's `frictionloss`, and the sign function rounded over a small velocity."""

from __future__ import annotations

import json
import math
from functools import cache

import mujoco
import numpy as np
import pytest
from planted_cases import load, motion_with, planted_case

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.effects.friction_limits import soft_coulomb_limit
from bench.discrepancy.model.mjcf_friction import frictionloss_of, softness
from bench.discrepancy.report.model_update import recipes
from bench.discrepancy.simulation.prescribed_response import driven_force
from bench.discrepancy.simulation.stick_slip import Elements, StructureMatrices, free_run

MASS, DAMPING, STIFFNESS, LOSS = 2.4, 6.0, 1500.0, 2.0
RATE = 500.0
NOISE = 5e-5
N, FINE = 2000, 50
"""Samples of a record, and steps a sample: MuJoCo is of first order, and at a step of 40 us off by a tenth of the noise."""


def text(friction: str, step: float = 1.0 / RATE) -> str:
    return (
        f'<mujoco><option timestep="{step}" gravity="0 0 0" integrator="implicitfast"><flag contact="disable"/></option><worldbody>'
        f'<body name="table"><inertial pos="0 0 0" mass="{MASS}" diaginertia=".01 .01 .01"/><joint name="guide" type="slide" '
        f'axis="1 0 0" stiffness="{STIFFNESS}" damping="{DAMPING}" {friction}/></body></worldbody>'
        '<actuator><motor name="shaker" joint="guide"/></actuator></mujoco>'
    )


@cache
def simulated(
    friction: str, seed: int, n: int, fine: int = 1
) -> tuple[np.ndarray, np.ndarray, mujoco.MjModel]:
    """Load and displacement (n,), by MuJoCo."""
    model = mujoco.MjModel.from_xml_string(text(friction, 1.0 / RATE / fine))
    data = mujoco.MjData(model)
    force, x = load(seed, n), np.zeros(n)
    for k in range(n):
        x[k] = data.qpos[0]
        after = force[min(k + 1, n - 1)]
        for part in range(fine):
            # a step holds its load: the mean of the straight line over it
            data.ctrl[0] = force[k] + (part + 0.5) / fine * (after - force[k])
            mujoco.mj_step(model, data)
    return force, x, model


@pytest.mark.parametrize(
    "soft",
    ["", 'solreffriction="0.004 1"', 'solimpfriction="0.4 0.9"', 'solreffriction="-900 -60"'],
    ids=["default", "quick", "yielding", "direct"],
)
def test_the_fast_simulator_creeps_as_mujoco_does(soft):
    n, fine = 1500, 20
    force, x, model = simulated(f'frictionloss="{LOSS}" {soft}', 3, n, fine)
    creep, lead = softness(model, model.dof_solref[0], model.dof_solimp[0], float(model.dof_invweight0[0]))
    structure = StructureMatrices(*(np.array([[a]]) for a in (MASS, DAMPING, STIFFNESS, 1.0)))
    table = np.array([[0, 0, soft_coulomb_limit.address, 1, 0, 0, 0, 0]], dtype=np.int64)
    theta = np.array([LOSS, LOSS * creep, lead, 0.0])
    motion = free_run(
        structure, Elements(table, np.ones((1, 1)), theta, np.zeros(0)), loads=force[:, None], step=1.0 / RATE, substeps=fine
    )  # fmt: skip
    # MuJoCo's step is of first order; at a twentieth of the sample it is off by half a step of 0.1 ms at 5 to 10 Hz
    assert np.std(motion.position[:, 0] - x) < 5e-3 * np.std(x)


def test_attributes_give_back_the_softness_they_stand_for():
    mobility = 1.0 / MASS
    attributes = frictionloss_of(LOSS, 3e-3, 0.012, mobility=mobility, step=1e-3)
    model = mujoco.MjModel.from_xml_string(text(" ".join(f'{k}="{v}"' for k, v in attributes.items())))
    creep, lead = softness(model, model.dof_solref[0], model.dof_solimp[0], float(model.dof_invweight0[0]))
    assert (LOSS * creep, lead) == pytest.approx((3e-3, 0.012), rel=1e-4)


def test_along_a_prescribed_motion_it_saturates_and_turns_round_early():
    t = 1e-3 * np.arange(2000)
    q, v = np.sin(2 * np.pi * t), 2 * np.pi * np.cos(2 * np.pi * t)
    lead = 0.02
    table = np.array([[0, 0, soft_coulomb_limit.address, 1, 0, 0, 0, 0]], dtype=np.int64)
    elements = Elements(table, np.ones((1, 1)), np.array([LOSS, 0.5, lead, 0.0]), np.zeros(0))
    force = driven_force(elements, position=q[:, None], velocity=v[:, None], step=1e-3)[:, 0]
    a = -((2 * np.pi) ** 2) * np.sin(2 * np.pi * t)
    # the acceleration is a difference over a step, half a step late
    np.testing.assert_allclose(force, LOSS * np.clip((v + lead * a) / 0.5, -1, 1), atol=0.02 * LOSS)


def mjcf_case(folder, model: str, true: str, parameters: dict):
    believed = {
        "mass:table": {"value": MASS, "std": 0.03}, "stiffness:guide": {"value": STIFFNESS, "std": 45.0},
        "damping:guide": {"value": DAMPING, "std": 1.0}, **parameters,
    }  # fmt: skip
    channels = {
        "load": {"unit": "N", "role": "measured", "actuator": "shaker"},
        "displacement": {"unit": "m", "noise_std": NOISE, "joint": "guide", "quantity": "position"},
    }
    (folder / "model.xml").write_text(text(model))
    (folder / "nominal.json").write_text(
        json.dumps({"rig": "model.xml", "parameters": believed, "channels": channels})
    )
    for seed, name in enumerate(("identification", "validation")):
        force, x, _ = simulated(true, seed, N, FINE)
        noisy = x + NOISE * np.random.default_rng(seed).standard_normal(len(x))
        table = np.column_stack([np.arange(len(x)) / RATE, force, noisy])
        np.savetxt(folder / f"{name}.csv", table, "%.9g", ",", header="time,load,displacement", comments="")
    return read_case(folder)


@pytest.mark.slow
def test_frictionloss_of_a_nominal_model_is_what_mujoco_makes_of_it(tmp_path):
    own = f'frictionloss="{LOSS}"'
    case = mjcf_case(tmp_path, own, own, {"frictionloss:guide": {"value": 1.1 * LOSS, "std": 0.2}})
    assert diagnose(case).verdict.verdict == "none"


@pytest.mark.slow
def test_frictionloss_that_is_missing_is_named_and_its_mjcf_closes_the_gap(tmp_path):
    case = mjcf_case(tmp_path, "", f'frictionloss="{LOSS}"', {})
    diagnosis = diagnose(case)
    (named,) = diagnosis.verdict.named
    assert named.name == "coulomb_friction"
    found = named.parameters
    for name, truth in {"friction_force": LOSS, "lead_time": 0.5 * 0.95 * 0.02}.items():
        assert abs(found[name].value - truth) < 5 * found[name].std + 0.01 * truth
    (recipe,) = recipes(diagnosis)
    attributes = recipe.mjcf.partition('name="guide" ')[2] or recipe.mjcf.partition('name="JOINT" ')[2]
    _, x, _ = simulated(f'frictionloss="{LOSS}"', 1, N, FINE)
    _, closed, _ = simulated(attributes.removesuffix("/>"), 1, N, FINE)
    assert np.std(closed - x) < 0.01 * np.std(x)


@pytest.mark.slow
def test_frictionloss_of_the_wrong_softness_gives_place_to_friction_that_sticks(tmp_path):
    hard = f'frictionloss="{LOSS}" solreffriction="0.0004 1" solimpfriction="0.999 0.9999"'
    parameters = {"frictionloss:guide": {"value": LOSS, "std": 0.2}}
    (named,) = diagnose(mjcf_case(tmp_path, f'frictionloss="{LOSS}"', hard, parameters)).verdict.named
    assert named.name == "coulomb_friction"
    assert named.parameters["friction_force"].value == pytest.approx(LOSS, rel=0.02)


@pytest.mark.slow
def test_a_sign_function_that_is_rounded_is_coulomb_friction_with_its_softness():
    limit, creep = 3.0, 0.02
    case = planted_case(
        lambda force: motion_with(force, lambda x, v, z: (limit * math.tanh(v / creep), [])), n=2500
    )
    (named,) = diagnose(case).verdict.named
    assert named.name == "coulomb_friction"
    for name, truth in {"friction_force": limit, "creep_velocity": creep}.items():
        estimate = named.parameters[name]
        assert abs(estimate.value - truth) < 5 * estimate.std + 0.01 * truth
