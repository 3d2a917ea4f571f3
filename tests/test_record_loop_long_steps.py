"""Long steps of the compiled record loop: across steps of the same command, samples read off the interpolant."""

from __future__ import annotations

import numpy as np
import pytest

from bench import Element, joint_rig, sdof_rig
from bench.errors import ParameterError, UnknownNameError
from bench.identification.linear_rig import LinearRig

CHANNELS = ("displacement", "velocity", "acceleration_x")
START = {"carriage": (0.002, 0.4)}


def _rig(*elements: Element, timestep: float = 5e-3) -> LinearRig:
    rig = sdof_rig(*elements, mass=2.0, damping=4.0, stiffness=1500.0, timestep=timestep)
    return LinearRig.of(rig, CHANNELS)


def _error(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.max(np.abs(found - expected) / np.max(np.abs(expected), axis=0)))


@pytest.mark.parametrize(
    ("elements", "bound"),
    [
        ((), 1e-8),
        ((Element.of("bouc_wen", "carriage", A=800.0, beta=60.0, gamma=40.0, n=1.5),), 1e-7),
        # the error at a kink is the tolerance's to some small power less: measured 4e-8
        ((Element.of("gap", "carriage", stiffness=3000.0, clearance=0.003),), 1e-6),
    ],
    ids=["linear", "bouc_wen", "gap"],
)
@pytest.mark.parametrize("stride", [1, 3])
def test_long_steps_give_what_short_ones_give(elements, bound, stride):
    rig = _rig(*elements)
    commands = np.zeros((300, 2))
    commands[:, 0] = np.repeat([0.0, 5.0, -3.0, 8.0, 8.0, 0.0], 50)
    long = rig.simulate(commands, initial=START, stride=stride, tolerance=1e-10)
    # a command that nothing reads and that changes at every step keeps the loop from long steps
    commands[::2, 1] = 1.0
    short = rig.simulate(commands, initial=START, stride=stride, tolerance=1e-12)
    assert long.shape == short.shape == (-(-300 // stride), 3)
    assert _error(long, short) < bound


def test_error_falls_with_the_tolerance():
    rig = _rig(Element.of("bouc_wen", "carriage", A=800.0, beta=60.0, gamma=40.0, n=1.5))
    zeros = np.zeros((200, 2))
    exact = rig.simulate(zeros, initial=START, tolerance=1e-13)
    tolerances = (1e-4, 1e-6, 1e-8)
    errors = [_error(rig.simulate(zeros, initial=START, tolerance=tol), exact) for tol in tolerances]
    # local errors add up over some fifty steps, and the law's force is not smooth where its velocity changes sign
    assert all(error < 100.0 * tol for error, tol in zip(errors, tolerances, strict=True))
    assert errors[2] < 1e-2 * errors[0]


def test_sizes_spare_a_state_at_rest_and_nothing_else():
    rig = LinearRig.of(joint_rig(timestep=1e-2), ("displacement_1", "displacement_2", "velocity_2"))
    zeros = np.zeros((200, 2))
    start = {"axial_1": (0.0, 1.0), "torsional_1": (0.0, 40.0)}
    exact = rig.simulate(zeros, initial=start, tolerance=1e-13)
    peaks = {
        "axial_1": (0.02, 1.0),
        "axial_2": (0.015, 0.4),
        "torsional_1": (0.9, 40.0),
        "torsional_2": (0.6, 15.0),
    }
    found = rig.simulate(zeros, initial=start, tolerance=1e-8, sizes=peaks)
    # a kink adds some; relative to the peaks, as the tolerance is
    assert _error(found, exact) < 1e-6
    with pytest.raises(UnknownNameError, match="axial_1"):
        rig.simulate(zeros, tolerance=1e-8, sizes={"axial_3": (1.0, 1.0)})


def test_divergence_ends():
    rig = LinearRig.of(sdof_rig(Element.of("cubic_stiffness", "carriage", k3=-1e9), mass=1.0), CHANNELS[:1])
    found = rig.simulate(np.zeros((500, 2)), initial={"carriage": (0.1, 0.0)}, tolerance=1e-6)
    assert not np.isfinite(found).all()


def test_records_from_many_starts_are_those_one_by_one():
    rig = _rig(Element.of("gap", "carriage", stiffness=3000.0, clearance=0.003))
    commands = np.random.default_rng(3).standard_normal((400, 2))
    starts = [{}, START, {"carriage": (0.0, -0.4)}, {"carriage": (0.01, 0.2)}, {"carriage": (-0.02, 0.0)}]
    for tolerance in (0.0, 1e-6):
        together = rig.simulate_batch(commands, initials=starts, stride=2, tolerance=tolerance, threads=2)
        alone = [rig.simulate(commands, initial=start, stride=2, tolerance=tolerance) for start in starts]
        # two callers that the same loop is compiled into contract products and sums each in its own way: they part by rounding at
        # fixed steps, and by no more than the tolerance where rounding decides the size of a step
        peak = np.abs(alone).max(axis=(0, 1))
        np.testing.assert_array_less(
            np.abs(together - alone), np.broadcast_to(max(tolerance, 1e-12) * peak, np.shape(alone))
        )
    with pytest.raises(ParameterError, match="no initial states came"):
        rig.simulate_batch(commands, initials=[])
