"""A play between motor and link: what is corrected while it is open, how closely runs have to listen, and what is named."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.misfit import log_likelihood
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.multibody.joint_forces import SLOTS, Slot
from bench.discrepancy.multibody.joint_run import predict
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.settings import DEFAULT

RATE, HALF, NOISE = 500.0, 0.03, 3e-4
BELIEVED = """<mujoco><option timestep="0.001"><flag contact="disable"/></option><worldbody><body name="arm">
  <inertial pos="0 0 -0.12" mass="0.5" diaginertia="0.002 0.002 0.0005"/>
  <joint name="hinge" type="hinge" axis="0 1 0" armature="0.028" damping="0.05"/></body></worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator></mujoco>"""
REAL = f"""<mujoco><option timestep="0.0002"><flag contact="disable"/></option><compiler angle="radian"/><worldbody>
  <body name="rotor"><inertial pos="0 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/>
  <joint name="motor" type="hinge" axis="0 1 0" armature="0.028" damping="0.05"/>
  <body name="arm"><inertial pos="0 0 -0.12" mass="0.5" diaginertia="0.002 0.002 0.0005"/>
  <joint name="play" type="hinge" axis="0 1 0" range="-{HALF} {HALF}" limited="true" solreflimit="0.002 1"/></body></body></worldbody>
  <actuator><motor name="motor" joint="motor"/></actuator></mujoco>"""


def measured(folder: Path, name: str, seconds: float, seed: int) -> None:
    """A record of the motor's torque and the link's angle."""
    model = mujoco.MjModel.from_xml_string(REAL)
    data, every = mujoco.MjData(model), round(1.0 / RATE / 0.0002)
    rng, n = np.random.default_rng(seed), round(seconds * RATE)
    time = np.arange(n) / RATE
    torque = sum(
        0.4 * np.sin(2 * np.pi * f * time + p)
        for f, p in zip((0.7, 1.3, 2.2, 3.1), 6.0 * rng.random(4), strict=True)
    )
    angle = np.empty(n)
    for k in range(n):
        angle[k] = data.qpos.sum()
        for i in range(every):
            data.ctrl[0] = torque[k] + i / every * (torque[min(k + 1, n - 1)] - torque[k])
            mujoco.mj_step(model, data)
    rows = np.column_stack([time, torque, angle + NOISE * rng.standard_normal(n)])
    np.savetxt(
        folder / f"{name}.csv", rows, delimiter=",", header="time,torque,angle", comments="", fmt="%.9g"
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("play")
    (path / "model.xml").write_text(BELIEVED, encoding="utf-8")
    parameter = {
        "mass:arm": {"value": 0.5, "std": 0.005, "unit": "kg"},
        "damping:hinge": {"value": 0.05, "std": 0.01, "unit": "N m s/rad"},
        "armature:hinge": {"value": 0.028, "std": 0.002, "unit": "kg m^2"},
    }
    channels = {
        "torque": {"unit": "N m", "role": "measured", "actuator": "motor", "noise_std": 0.0},
        "angle": {
            "unit": "rad",
            "noise_std": NOISE,
            "side": "link",
            "joint": "hinge",
            "quantity": "position",
        },
    }
    told = {"rig": "model.xml", "parameters": parameter, "channels": channels}
    (path / "nominal.json").write_text(json.dumps(told), encoding="utf-8")
    measured(path, "identification", 4.0, 1)
    measured(path, "validation", 3.0, 2)
    return path


@pytest.mark.parametrize(("side", "moved"), [(1.0, [False, True]), (0.0, [True, False])])
def test_across_an_open_play_the_encoder_corrects_its_own_side_alone(side, moved):
    p = np.zeros(SLOTS)
    p[[Slot.GEAR, Slot.KP, Slot.RATIO, Slot.TRAIN, Slot.TRAIN_STIFFNESS]] = 1.0
    p[[Slot.LOW, Slot.HIGH]] = -1e9, 1e9
    p[Slot.MOTOR], p[Slot.ENCODER] = 0.5, side
    still, n = np.zeros(4), 5
    for clearance, expected in ((0.1, moved), (0.0, [True, True])):
        p[Slot.CLEARANCE] = clearance
        _, states = predict(
            p, (np.ones(4), still, still, still, still), still, 1e-3, 1, (np.full(n, 1e-3), np.zeros(0)),
            np.array([[0.5, 0.0], [0.0, 0.0]]), np.zeros((1, 4)),
        )  # fmt: skip
        assert (np.abs(states[1, [0, 2]]) > 1e-5).tolist() == expected


def left(problem: ArticulatedProblem, hypothesis: JointHypothesis, vector: np.ndarray) -> float:
    """Log-likelihood of the logs where a hypothesis stands at a vector."""
    return log_likelihood(
        problem.records, problem.octaves, ArticulatedFit.at(problem, hypothesis, vector).chi2
    )


def test_runs_listen_to_the_encoder_where_impacts_lose_them_and_nowhere_else(folder):
    case, compiled, _ = admitted_robot(read_case(folder), anyway=False, settings=DEFAULT)
    problem = ArticulatedProblem.of(case, ArticulatedModel.of(compiled, case.rig), case.identification)
    (play,) = (p for p in placements(problem, CATALOGUE) if p.effect.play)
    eta = np.array([np.log(HALF / play.scales.position), 6.5, 1.0, -0.01, 1.0])
    parted = np.concatenate([np.zeros(3), eta])
    soft = problem.softened(0.04)
    assert soft.softness == 0.04
    none = [log_likelihood(p.records, p.octaves, p.octaves.count) for p in (soft, problem)]
    assert none[0] < none[1]  # it pays for what it hears
    assert left(soft, (play,), parted) > left(problem, (play,), parted)


@pytest.mark.slow
def test_a_play_before_a_link_that_bounces_in_it_is_named_with_its_width(folder):
    others = {
        "coulomb_friction",
        "stribeck_friction",
        "joint_compliance",
        "actuator_delay",
        "damping_error",
        "position_offset",
    }
    left_out = {effect.name for effect in CATALOGUE if not effect.play} - others
    verdict = diagnose(read_case(folder), most=1, exclude=left_out).verdict
    assert [(effect.name, effect.where) for effect in verdict.named] == [("backlash", "hinge")]
    width = verdict.named[0].parameters["half_clearance"]
    assert width.value == pytest.approx(HALF, rel=0.1)  # the contacts of MuJoCo give way
    assert width.std >= 0.01 * width.value
    assert verdict.gap.after < 0.3 * verdict.gap.before
    assert any("corrected by the encoder" in line for line in verdict.warnings)


LEG = """<mujoco><option timestep="0.0002"><flag contact="disable"/></option><compiler angle="radian"/><worldbody>{}</worldbody>
  <actuator><position name="servo" joint="knee" kp="13" kv="0.2"/></actuator></mujoco>"""
SHIN = '<inertial pos="0 0 -0.06" mass="0.09" diaginertia="2e-4 2e-4 1e-5"/>'
KNEE = '<joint name="knee" type="hinge" axis="0 1 0" armature="0.006" damping="0.05"/>'
LOOSE = 0.02


def walked(folder: Path, name: str, seconds: float, seed: int) -> None:
    """A log of goals and of the angle of a light shin behind the play of its servo's gear, at 100 Hz."""
    play = f'<joint name="play" type="hinge" axis="0 1 0" range="-{LOOSE} {LOOSE}" limited="true" solreflimit="0.003 1"/>'
    rotor = '<inertial pos="0 0 0" mass="1e-3" diaginertia="1e-8 1e-8 1e-8"/>'
    model = mujoco.MjModel.from_xml_string(LEG.format(f"<body>{rotor}{KNEE}<body>{SHIN}{play}</body></body>"))
    data, rng, time = (
        mujoco.MjData(model),
        np.random.default_rng(seed),
        np.arange(round(100.0 * seconds)) / 100.0,
    )
    goal = sum(
        0.2 * np.sin(2 * np.pi * f * time + p)
        for f, p in zip((0.4, 0.9, 1.7, 2.6), 6.0 * rng.random(4), strict=True)
    )
    goal *= np.minimum(time / 0.5, 1.0)
    angle = np.empty(len(time))
    for k, asked in enumerate(goal):
        angle[k], data.ctrl[0] = data.qpos.sum(), asked
        mujoco.mj_step(model, data, 50)
    rows = np.column_stack([time, goal, angle + 4e-4 * rng.standard_normal(len(time))])
    np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header="time,goal,angle", comments="", fmt="%.9g")


@pytest.mark.slow
def test_a_play_is_found_where_long_steps_bounce_off_its_teeth_and_one_start_leads_nowhere(tmp_path):
    """Steps of 2.5 ms follow the servo, not the teeth; and of the clearances that promise most, few lead to the true one."""
    (tmp_path / "leg.xml").write_text(LEG.format(f'<body name="shin">{SHIN}{KNEE}</body>'), encoding="utf-8")
    parameters = {
        "mass:shin": {"value": 0.09, "std": 0.003, "unit": "kg"},
        "damping:knee": {"value": 0.05, "std": 0.015, "unit": "N m s/rad"},
        "armature:knee": {"value": 0.006, "std": 0.0006, "unit": "kg m^2"},
        "kp:servo": {"value": 13.0, "std": 1.0, "unit": "N m/rad"},
    }
    channels = {
        "goal": {"unit": "rad", "role": "command", "actuator": "servo", "noise_std": 0},
        "angle": {
            "unit": "rad",
            "noise_std": 4e-4,
            "side": "link",
            "joint": "knee",
            "quantity": "position",
        },
    }
    told = {
        "rig": "leg.xml",
        "load_interpolation": "zero_order_hold",
        "parameters": parameters,
        "channels": channels,
    }
    (tmp_path / "nominal.json").write_text(json.dumps(told), encoding="utf-8")
    for seed, (name, seconds) in enumerate(
        {"identification": 12, "identification_2": 12, "validation": 10}.items()
    ):
        walked(tmp_path, name, seconds, 1 + seed)
    verdict = diagnose(read_case(tmp_path)).verdict
    assert [(effect.name, effect.where) for effect in verdict.named] == [("backlash", "knee")]
    assert verdict.named[0].parameters["half_clearance"].value == pytest.approx(LOOSE, rel=0.05)
    assert verdict.gap.after < 0.4 * verdict.gap.parameters_only
