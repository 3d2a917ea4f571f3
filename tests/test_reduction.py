"""The reduced-order joint: identified, swapped in, compared."""

from __future__ import annotations

import pytest

import bench
from bench import Element, compare, joint_rig, reduced_joint
from bench.demo.joint import (
    JOINT_SETUP,
    laboratory_view,
)
from bench.errors import UnknownNameError
from bench.rig import simulate
from bench.signals import BandLimitedNoise, Excitation

AXES = ("axial", "torsional")


def excitation(duration: float = 4.0, level: float = 0.3) -> Excitation:
    signals = {
        "force": BandLimitedNoise(cutoff=12.0, peak=level * JOINT_SETUP.peak),
        "torque": BandLimitedNoise(cutoff=12.0, peak=level * JOINT_SETUP.peak_torque),
    }
    return Excitation(signals, duration=duration, sample_rate=1000.0)


@pytest.fixture(scope="module")
def linear_rig():
    elements = (
        Element.of("linear", "axial", stiffness=4e4, damping=800.0, name="a"),
        Element.of("linear", "torsional", stiffness=25.0, damping=0.5, name="t"),
    )
    return joint_rig(*elements)


def test_polynomial_of_a_linear_joint_is_that_joint(linear_rig, rng):
    """Order one holds the linear joint exactly: what is left is rounding, amplified by four seconds of motion."""
    record = simulate(linear_rig, excitation(), rng=rng)
    reduced = reduced_joint(
        laboratory_view([record], linear_rig), AXES, model="polynomial", orders=(1, 1, 1, 1)
    )
    comparison = compare(linear_rig, linear_rig.with_(elements=(reduced,)), excitation(), seed=7)
    assert comparison.true.content_hash != comparison.reduced.content_hash
    assert {"axial", "torsional", "displacement_1", "acceleration_2_x"} <= set(comparison.nmse)
    assert max(comparison.nmse.values()) < 1e-12
    assert not [name for name in comparison.nmse if name in {"force", "torque"}]  # commands are no result


def test_reduced_joint_takes_the_true_ones_channels_and_knows_its_range(rng):
    rig = joint_rig()
    record = simulate(rig, excitation(level=1.0), rng=rng)
    data = laboratory_view([record], rig)
    reduced = reduced_joint(data, AXES, model="network", n_hidden=6, n_restarts=1, max_iterations=40, rng=rng)
    assert reduced.validity is not None
    assert not reduced.validity.outside(data.states).any()
    assert reduced.validity.outside(2.0 * data.states).any()
    comparison = compare(rig, rig.with_element(reduced), excitation(level=0.8), seed=3, settle=0.5)
    # six neurons are few: the point is that the swapped rig runs and is scored channel by channel
    assert comparison.nmse["joint/force_1"] < 50.0
    assert comparison.reduced.settle == 0.5


def test_unknown_model_is_refused(linear_rig, rng):
    data = laboratory_view([simulate(linear_rig, excitation(0.5), rng=rng)], linear_rig)
    with pytest.raises(UnknownNameError, match="unknown reduced-order model 'spline'"):
        reduced_joint(data, AXES, model="spline")  # type: ignore[arg-type]


def test_the_former_name_warns():
    with pytest.warns(DeprecationWarning, match="reduced_joint"):
        assert bench.reduce is reduced_joint
