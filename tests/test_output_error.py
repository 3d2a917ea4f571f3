"""Output-error fits of a rig: recovery with and without noise, two engines, one answer."""

from __future__ import annotations

import numpy as np
import pytest

from bench import Element, Excitation, Rig, sdof_rig, simulate
from bench.errors import IdentificationError, UnknownNameError
from bench.identification.output_error import fit_output_error
from bench.measurement import Chain, Noise, measure
from bench.recording import Recording, nrmse
from bench.signals import Multisine

FREE = (
    "carriage.bouc_wen/A",
    "carriage.bouc_wen/beta",
    "structure/mass/carriage",
    "structure/stiffness/carriage",
)
TRUTH = np.array([800.0, 60.0, 2.0, 1500.0])


def rig_of(values: np.ndarray) -> Rig:
    a, beta, mass, stiffness = values
    return sdof_rig(
        Element.of("bouc_wen", "carriage", A=a, beta=beta, gamma=20.0),
        mass=mass,
        stiffness=stiffness,
        damping=4.0,
    )


def record(seed: int, duration: float = 4.0) -> Recording:
    signal = Multisine(band=(0.5, 15.0), phases="random", peak=60.0)
    drive = Excitation({"shaker": signal}, duration=duration, sample_rate=1000.0)
    return simulate(rig_of(TRUTH), drive, rng=np.random.default_rng(seed))


def fitted(model) -> np.ndarray:
    return np.array([model.parameters[name] for name in FREE])


@pytest.mark.parametrize("engine", ["linear", "mujoco"])
def test_recovers_the_rig_and_predicts_another_excitation(engine):
    start = TRUTH * np.array([1.2, 0.7, 1.05, 0.95])
    model = fit_output_error(rig_of(start), [record(1)], free=FREE, channels=("displacement",), engine=engine)
    # without noise only the fit's own tolerance is left
    np.testing.assert_allclose(fitted(model), TRUTH, rtol=1e-4)
    unseen = record(2)
    drive = {"shaker": unseen["shaker"]}
    assert nrmse(unseen["displacement"], simulate(rig_of(fitted(model)), drive)["displacement"]) < 1e-4


def test_noise_moves_the_estimates_by_what_their_standard_deviations_say(rng):
    clean = record(1)
    noisy = measure(
        clean, {"displacement": Chain(Noise(std=0.01 * float(np.std(clean["displacement"]))))}, rng
    )
    model = fit_output_error(rig_of(TRUTH * 1.05), [noisy], free=FREE, channels=("displacement",))
    std = np.array([model.std[name] for name in FREE])
    assert np.all(std > 0.0)
    assert np.all(np.abs(fitted(model) - TRUTH) < 4.0 * std)  # four standard deviations, four parameters


def test_bad_requests_say_what_was_expected():
    with pytest.raises(IdentificationError, match="at least one each"):
        fit_output_error(rig_of(TRUTH), [], free=FREE)
    with pytest.raises(UnknownNameError):
        fit_output_error(rig_of(TRUTH), [record(1, 1.0)], free=("carriage.bouc_wen/alpha",))
