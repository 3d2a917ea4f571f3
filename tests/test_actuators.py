"""Actuators of MuJoCo as the equations of the joints hold them: a run of one joint against a plain simulation."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from test_apply import effect

from bench.discrepancy.application.applying import Findings, apply
from bench.discrepancy.articulated.nominal_values import with_nominal_values
from bench.discrepancy.case.case import NominalParameter
from bench.discrepancy.multibody.joint_forces import Slot
from bench.discrepancy.multibody.joint_run import predict
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.nominal_parameters import base_slots, move
from bench.discrepancy.verdict import NominalEstimate
from bench.errors import ModelError
from bench.rig import Rig
from bench.rig.actuators import commanded, drive_of, drive_value, set_drive

STEP, MASS, LENGTH, GYRATION = 2e-4, 0.5, 0.1, 1e-4
PENDULUM = f"""<mujoco><option timestep="{STEP}" integrator="implicitfast"/><worldbody><body>
<joint name="pivot" axis="0 1 0" damping="0.02" armature="0.001"/>
<inertial pos="0 0 -{LENGTH}" mass="{MASS}" diaginertia="{GYRATION} {GYRATION} {GYRATION}"/></body></worldbody>
<actuator>{{}}</actuator></mujoco>"""
DC = 'dcmotor name="a" joint="pivot" motorconst="0.387" resistance="4.02"'
ACTUATORS = {
    "motor behind a gear": ('motor name="a" joint="pivot" gear="3"', 0.05, "load"),
    "position servo behind a gear": ('position name="a" joint="pivot" kp="0.3" kv="0.01" gear="3"', 1.0, "position"),
    "velocity servo behind a gear": ('velocity name="a" joint="pivot" kv="0.05" gear="3"', 5.0, "velocity"),
    "position servo with a delay": (
        'position name="a" joint="pivot" kp="0.9" kv="0.03" delay="0.02" nsample="110"', 1.0, "position",
    ),
    "DC motor, voltage": (f'{DC} input="voltage" saturation="0.5 0 0"', 6.0, "voltage"),
    "DC motor whose voltage saturates": (f'{DC} input="pos" controller="0.8 0 0.037 0 0 7.4"', 1.2, "position"),
    "DC motor whose torque saturates": (f'{DC} input="pos" controller="2 0 0.05 0 0 7.4" saturation="0.5 0 0"', 1.2, "position"),
    "DC motor with a rotor behind a gear": (
        'dcmotor name="a" joint="pivot" motorconst="0.1" resistance="4.02" input="pos" controller="0.08 0 0.002 0 0 7.4" gear="3" '
        'armature="0.0002" damping="0.001"', 1.2, "position",
    ),
}  # fmt: skip


def model_with(actuator):
    return mujoco.MjModel.from_xml_string(PENDULUM.format(f"<{actuator}/>"))


def simulated(model, command):
    data, position = mujoco.MjData(model), np.empty(len(command))
    for k, u in enumerate(command):
        data.ctrl[0], position[k] = u, data.qpos[0]
        mujoco.mj_step(model, data)
    return position


@pytest.mark.parametrize("name", ACTUATORS)
def test_a_joint_runs_as_mujoco_has_it_with_every_actuator(name):
    actuator, amplitude, asked = ACTUATORS[name]
    model = model_with(actuator)
    t = STEP * np.arange(15_000)
    command = amplitude * np.sin(2.0 * np.pi * (0.5 + 0.4 * t) * t)
    position = simulated(model, command)
    (joint,) = ArticulatedModel.of(model).joints
    assert commanded(model, 0) == asked
    reference = 0.5 * (position[1:] + position[:-1])
    weight = MASS * 9.81 * LENGTH
    bias, slope = weight * np.sin(reference), weight * np.cos(reference)
    inertia = np.full(len(reference), MASS * LENGTH**2 + GYRATION + joint.armature)
    arrays = (inertia, bias, slope, reference, np.abs(bias))
    apart, _ = predict(
        base_slots(joint, False), arrays, command[:-1], STEP, 1, (position, np.zeros(0)), np.zeros((2, 2)), np.zeros((1, 2)),
    )  # fmt: skip
    # MuJoCo's step is of first order, and holds a delayed input where the run goes along straight lines: half a step of either
    fastest = np.abs(np.gradient(position, STEP)).max()
    assert np.abs(apart[:, 0]).max() < 5.0 * STEP * fastest


def test_torques_and_commands_of_a_drive_are_each_others_inverse():
    drive = drive_of(model_with(ACTUATORS["position servo behind a gear"][0]), 0)
    q, v = np.array([0.1, -0.3]), np.array([2.0, -1.0])
    command = drive.command(np.array([0.05, 0.2]), q, v)
    np.testing.assert_allclose(drive.torque(command, q, v), [0.05, 0.2])
    assert drive.stiffness == pytest.approx(9 * 0.3)
    assert drive.damping == pytest.approx(9 * 0.01)


def test_a_motor_gives_what_its_voltage_leaves():
    drive = drive_of(model_with(ACTUATORS["DC motor whose voltage saturates"][0]), 0)
    assert drive.stall == pytest.approx(0.387 / 4.02 * 7.4)
    far, speed = np.array([10.0, -10.0]), np.array([3.0, 3.0])
    expected = np.array([1.0, -1.0]) * drive.stall - 0.387**2 / 4.02 * speed
    np.testing.assert_allclose(drive.torque(far, np.zeros(2), speed), expected)


@pytest.mark.parametrize(
    "name",
    ["position servo behind a gear", "DC motor whose voltage saturates", "position servo with a delay"],
)
def test_numbers_of_a_drive_are_set_as_they_are_read(name):
    model = model_with(ACTUATORS[name][0])
    kinds = {
        "a gear": ("kp", "kv", "gear"),
        "saturates": ("kp", "kv", "forcerange"),
        "a delay": ("kp", "delay"),
    }
    kinds = next(mine for end, mine in kinds.items() if name.endswith(end))
    before = base_slots(ArticulatedModel.of(model).joints[0], False)
    for kind in kinds:
        value = drive_value(model, 0, kind)
        set_drive(model, 0, kind, 1.5 * value)
        assert drive_value(model, 0, kind) == pytest.approx(1.5 * value)
        move(before, kind, 0.5 * value)
    after = base_slots(ArticulatedModel.of(model).joints[0], False)
    np.testing.assert_allclose(before, after)
    assert after[Slot.KP] > 0.0


def test_what_a_drive_has_not_cannot_be_set():
    with pytest.raises(ModelError, match="no limit of its force"):
        set_drive(model_with(ACTUATORS["motor behind a gear"][0]), 0, "forcerange", 1.0)
    with pytest.raises(ModelError, match="has no delay"):
        set_drive(model_with(ACTUATORS["motor behind a gear"][0]), 0, "delay", 1.0)
    with pytest.raises(ModelError, match="takes a voltage"):
        set_drive(model_with(ACTUATORS["DC motor, voltage"][0]), 0, "kp", 1.0)
    follower = model_with(ACTUATORS["velocity servo behind a gear"][0])
    with pytest.raises(ModelError, match="kv:a"):
        set_drive(follower, 0, "kp", 1.0)
    before = base_slots(ArticulatedModel.of(follower).joints[0], False)
    set_drive(follower, 0, "kv", 0.08)
    move(before, "kv", 0.03)
    np.testing.assert_allclose(before, base_slots(ArticulatedModel.of(follower).joints[0], False))
    assert commanded(follower, 0) == "velocity"
    limited = model_with('motor name="a" joint="pivot" forcerange="-1 2"')
    set_drive(limited, 0, "forcerange", 3.0)
    np.testing.assert_allclose(limited.actuator_forcerange[0], [-1.5, 3.0])


@pytest.mark.parametrize(
    ("more", "word"),
    [
        ('input="voltage" inductance="0.01"', "inductance"), ('input="voltage" cogging="0.1 5 0"', "cogging"),
        ('input="vel" controller="0 0 0.1"', "takes velocity"), ('input="pos vel" controller="1 0 0.1"', "another input"),
    ],
)  # fmt: skip
def test_a_motor_with_more_than_its_controller_is_refused_in_words(more, word):
    with pytest.raises(ModelError, match=word):
        ArticulatedModel.of(model_with(f"{DC} {more}"))


def test_values_of_nominal_json_reach_a_motor(tmp_path):
    path = tmp_path / "model.xml"
    path.write_text(PENDULUM.format(f"<{ACTUATORS['DC motor whose voltage saturates'][0]}/>"))
    model = with_nominal_values(
        Rig.from_file(path), [NominalParameter("kp:a", 0.9, 0.1), NominalParameter("forcerange:a", 0.8, 0.1)]
    )
    drive = drive_of(model, 0)
    assert (drive.kp, drive.stall) == pytest.approx((0.9, 0.8))


def test_what_is_found_of_a_motor_is_written_into_its_model(tmp_path):
    path = tmp_path / "model.xml"
    path.write_text(PENDULUM.format(f"<{ACTUATORS['DC motor whose voltage saturates'][0]}/>"))
    before = drive_of(mujoco.MjModel.from_xml_path(str(path)), 0)
    numbers = tuple(
        NominalEstimate(f"{kind}:a", value, 0.01, 1.0, 0.1, 1.0)
        for kind, value in (("kp", 0.9), ("kv", 0.05), ("forcerange", 0.6), ("delay", 0.01))
    )
    put = apply(path, Findings((), numbers))
    drive = drive_of(put.spec.compile(), 0)
    assert (drive.kp, drive.kv, drive.stall, drive.delay) == pytest.approx((0.9, 0.05, 0.6, 0.01))
    # all of its force, and the gain alone
    weaker = drive_of(
        apply(path, Findings((effect("force_gain_error", "a", relative_error=-0.2),))).spec.compile(), 0
    )
    ratios = [getattr(weaker, name) / getattr(before, name) for name in ("kp", "kv", "back_emf", "stall")]
    np.testing.assert_allclose(ratios, 0.8)
    softer = drive_of(
        apply(path, Findings((effect("servo_gain_error", "a", relative_error=0.5),))).spec.compile(), 0
    )
    assert (softer.kp / before.kp, softer.stall) == pytest.approx((1.5, before.stall))
    # a servo that reads too much stands where its reading is the target
    off = apply(path, Findings((effect("position_offset", "pivot", offset=0.1, in_loop=1.0),)))
    assert any("data.ctrl[u] -= 0.1" in line for line in off.lines)
