"""The environment with a user's own model: hidden parameters in MuJoCo, limits, targets as CSV, and models that it cannot take."""

from __future__ import annotations

import pickle
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from bench.errors import BenchError, ParameterError
from envs.arm_design import ArmDesignSettings, design_targets
from envs.arms import ArmArguments, arm_setup
from envs.model import ModelExcitationEnv, ModelExcitationVectorEnv

ARM = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.002" integrator="implicitfast"><flag contact="disable"/></option>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="hinge" axis="0 0 1" range="-1 2" damping=".4" frictionloss=".2" armature=".02"/>
      <inertial pos=".1 0 0" mass=".5" diaginertia=".003 .003 .003"/>
      <body name="forearm" pos=".2 0 0">
        <joint name="elbow" type="hinge" axis="0 1 0" range="-1.5 1.5" damping=".1"/>
        <inertial pos=".08 0 0" mass=".2" diaginertia=".001 .001 .001"/>
        <geom type="capsule" fromto="0 0 0 .16 0 0" size=".02" mass="0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="turn" joint="shoulder" kp="20" kv=".5" forcerange="-8 8"/>
    <position name="bend" joint="elbow" kp="12" kv=".3" forcerange="-4 4"/>
  </actuator>
</mujoco>
"""
SHORT: dict[str, Any] = {"duration": 1.0, "window": 0.1}


@pytest.fixture
def arm(tmp_path: Path) -> str:
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    return str(path)


def test_gymnasium_finds_nothing_to_complain_of_with_a_model(arm: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make("JointBench/ModelExcitation-v0", model=arm, **SHORT)
        check_env(env.unwrapped, skip_render_check=True)


def test_arms_hold_their_hidden_parameters(arm: str) -> None:
    """What ideal sensors show is what MuJoCo gives for the drawn model on its own."""
    setup = arm_setup(ArmArguments(arm, {}, {}, {}, {}))
    env = ModelExcitationEnv(model=arm, enforcement="cost", **SHORT)
    for seed in (3, 4):  # the second time over: nothing of the first arm may stay
        env.reset(seed=seed)
        shown = []
        for window in range(10):
            action = np.array([0.3 * np.sin(window), 0.2 * np.cos(window)], dtype=np.float32)
            env.step(action)
            shown.append(env.benches.positions(0))
        model = mujoco.MjModel.from_xml_string(ARM)
        assert env.truth is not None
        for name, value in env.truth.values.items():
            quantity, _, joint = name.partition(":")
            getattr(model, f"dof_{quantity}")[model.joint(joint).dofadr[0]] = value
        data = mujoco.MjData(model)
        data.qpos[:] = [0.5, 0.0]
        expected = []
        for target in env.benches.targets(0):
            data.ctrl[:] = target
            mujoco.mj_step(model, data, setup.substeps)
            expected.append(data.qpos.copy())
        np.testing.assert_allclose(
            shown, expected[9::10], rtol=0.0, atol=1e-12
        )  # the same code: rounding only


def test_reward_tells_motion_from_rest(arm: str) -> None:
    """At rest friction cannot be told; moving, it can, and an episode's rewards add up to the merit."""
    merits = []
    for size in (0.0, 0.3):
        env = ModelExcitationEnv(model=arm, enforcement="cost", penalty=0.0, duration=3.0)
        env.reset(seed=1)
        total, info = 0.0, {}
        for window in range(30):
            _, reward, *_, info = env.step(size * np.sin([1.1 * window, 0.8 * window]).astype(np.float32))
            total += reward
        assert total == pytest.approx(info["merit"], abs=1e-9)
        merits.append(info["merit"])
    assert merits[0] < 0.5 * merits[1]


def test_vector_environment_of_models_has_the_same_numbers(arm: str) -> None:
    ours = ModelExcitationVectorEnv(3, threads=2, model=arm, duration=0.3)
    singles = [ModelExcitationEnv(model=arm, duration=0.3) for _ in range(3)]
    ours.action_space.seed(0)
    first, _ = ours.reset(seed=5)
    np.testing.assert_array_equal(first, [env.reset(seed=5 + i)[0] for i, env in enumerate(singles)])
    for window in range(3):
        actions = 0.3 * ours.action_space.sample()
        if window == 1:
            ours = pickle.loads(pickle.dumps(ours))
        observation, reward, *_ = ours.step(actions)
        apart = [env.step(action) for env, action in zip(singles, actions, strict=True)]
        np.testing.assert_array_equal(observation, [item[0] for item in apart])
        np.testing.assert_array_equal(reward, [item[1] for item in apart])


def test_targets_keep_range_speed_and_torque_and_come_out_as_csv(arm: str, tmp_path: Path) -> None:
    asked = ArmArguments(arm, {}, {"elbow": (-1.0, 1.0)}, {"shoulder": 1.0, "elbow": 2.0}, {"shoulder": 3.0})
    made = design_targets(arm_setup(asked), settings=ArmDesignSettings(candidates=1, draws=2))
    assert 0.5 < max(made.reached) <= 1.0  # as large as a limit allows, nearly
    made.write(tmp_path / "targets.csv")
    assert (tmp_path / "targets.csv").read_text().splitlines()[0] == "time [s],turn [rad],bend [rad]"
    rows = np.loadtxt(tmp_path / "targets.csv", delimiter=",", skiprows=1)
    assert np.all(np.abs(rows[:, 1] - 0.5) <= 1.35)
    assert np.all(np.abs(rows[:, 2]) <= 0.9)
    model = mujoco.MjModel.from_xml_string(ARM)  # the model as it is: in the middle of what may be
    data = mujoco.MjData(model)
    data.qpos[:] = [0.5, 0.0]
    speeds, torques = [], []
    for target in rows[:, 1:]:
        data.ctrl[:] = target
        mujoco.mj_step(model, data, 5)
        speeds.append(np.abs(data.qvel))
        torques.append(np.abs(data.qfrc_actuator))
    assert np.all(np.max(speeds, axis=0) <= [1.0, 2.0])
    assert np.all(np.max(torques, axis=0) <= [3.0, 4.0])


def test_targets_that_leave_a_limit_are_not_written(arm: str, tmp_path: Path) -> None:
    env = ModelExcitationEnv(model=arm, enforcement="cost", **SHORT)
    env.reset(seed=0)
    with pytest.raises(ParameterError, match="no window"):
        env.benches.write_targets(tmp_path / "targets.csv")
    for window in range(10):
        env.step(np.full(2, (-1.0) ** window, dtype=np.float32))
    with pytest.raises(ParameterError, match="ask for less"):
        env.benches.write_targets(tmp_path / "targets.csv")
    assert not (tmp_path / "targets.csv").exists()


@pytest.mark.parametrize(
    ("change", "arguments", "message"),
    [
        (('range="-1 2"', ""), {}, "joint 'shoulder' has no range"),
        (('type="hinge" axis="0 0 1" range="-1 2"', 'type="ball"'), {}, "ball joint"),
        (("", ""), {"ranges": {"elbow": (2.0, 3.0)}}, "within the model's"),
        (("", ""), {"velocity": {"elbo": 1.0}}, "Did you mean 'elbow'"),
        (("", ""), {"uncertain": {"dampng:elbow": (0.1, 1.0)}}, "dampng"),
        (("", ""), {"uncertain": {"inertia:forearm": (0.1, 1.0)}}, "unknown quantity of a model"),
        (("", ""), {"average": "posterior"}, "average means nothing"),
        (("<position", "<motor"), {}, "ctrlrange"),
        (('<body name="upper">', "<body>"), {}, "body 1 of .* has no name"),
    ],
)
def test_models_and_arguments_are_checked(
    tmp_path: Path, change: tuple[str, str], arguments: dict[str, Any], message: str
) -> None:
    path = tmp_path / "arm.xml"
    text = ARM.replace(*change) if change[0] else ARM
    if "<motor" in text:
        text = text.replace('kp="20" kv=".5"', "").replace('kp="12" kv=".3"', "")
    path.write_text(text)
    with pytest.raises(BenchError, match=message):
        ModelExcitationEnv(model=str(path), **arguments)


def test_a_model_has_to_be_named() -> None:
    with pytest.raises(TypeError, match="takes the path of an MJCF"):
        ModelExcitationEnv()
