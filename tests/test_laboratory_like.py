"""Cases as a laboratory has them: integrated rightly, written so that they are read as meant, and graded by names that exist."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from bench.discrepancy import read_case
from bench.discrepancy.blind.protocol import write_case
from bench.discrepancy.effects.catalogue import CATALOGUE

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from laboratory.machines import Channel, machine  # noqa: E402
from laboratory.made import STEP, march, unstated  # noqa: E402
from laboratory.structures import STRUCTURES  # noqa: E402
from laboratory_like import OSCILLATORS, prescribed  # noqa: E402


def spring():
    return prescribed(
        np.random.default_rng(1),
        "spring",
        lambda x, v: 500.0 * x,
        {"stiffness": (500.0, 5.0, "N/m")},
        [[]],
        (),
        "a spring as its nominal model has it",
    )


def test_states_are_those_of_the_exact_solution():
    inputs = np.ones((200, 1, 2))
    states = march(lambda s, u: 20.0 * (u - s), np.zeros((1, 2)), inputs)
    exact = 1.0 - np.exp(-20.0 * STEP * np.arange(200))
    np.testing.assert_allclose(states[:, 0, 1], exact, atol=1e-9)


def test_a_case_of_which_the_noise_is_not_stated_is_read_as_one(tmp_path):
    made = unstated(spring())
    write_case(made.case, tmp_path)
    read = read_case(tmp_path)
    assert made.name == "lab_spring_unstated"
    assert read.channel("force").noise_std is None
    assert read.channel("displacement").noise_std == pytest.approx(2e-6)
    assert len(read.identification) == 2


def test_what_is_right_has_a_name_of_the_catalogue():
    known = {effect.name for effect in CATALOGUE}
    for made in (*OSCILLATORS, *STRUCTURES):
        assert known >= {*made.also, *(name for group in made.right for name in group)}, made.name


def test_a_machine_is_read_with_its_own_model(tmp_path):
    mjcf = (
        '<mujoco><worldbody><body name="arm"><joint name="hinge" type="hinge" axis="0 0 1" stiffness="2"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>'
        '<actuator><motor name="drive" joint="hinge"/></actuator></mujoco>'
    )
    channels = {
        "torque": Channel("N m", "command", 0.0, "actuator:drive"),
        "angle": Channel("rad", "response", 1e-3, "joint:hinge", 0.01),
    }
    signals = {name: np.random.default_rng(2).standard_normal((200, 3)) for name in channels}
    made = machine(
        np.random.default_rng(1),
        tmp_path / "models",
        "stage",
        mjcf,
        {"stiffness:hinge": (2.0, 0.1, "N m/rad")},
        channels,
        signals,
        [[]],
        (),
        "nothing",
    )
    write_case(made.case, tmp_path / "case")
    read = read_case(tmp_path / "case")
    assert (tmp_path / "case" / read.rig).read_text() == mjcf
    assert [c.target for c in read.channels] == ["actuator:drive", "joint:hinge"]
    angle = read.validation[0].values["angle"]
    np.testing.assert_allclose(angle, np.round(signals["angle"][:, 2] / 0.01) * 0.01, atol=1e-9)
