"""Cases of the second laboratory: integrated rightly, complete, graded by names that exist, and written so that they are read as meant."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bench.discrepancy import read_case
from bench.discrepancy.effects.catalogue import CATALOGUE

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from second_laboratory_cases.catalogue import CASES  # noqa: E402
from second_laboratory_cases.making import made  # noqa: E402
from second_laboratory_cases.properties import Properties  # noqa: E402
from second_laboratory_cases.time_stepping import Drive, component_force, march  # noqa: E402
from second_laboratory_cases.writing import acceptance, write_case  # noqa: E402


def released(p, substeps, seconds=2.0, rate=100.0):
    """Displacement of an oscillator that is released from one metre."""
    return march(p, np.zeros(round(seconds * rate)), rate, substeps, 1.0, Drive()).displacement


def test_free_decay_is_that_of_the_exact_solution_to_second_order():
    p = Properties(mass=2.0, stiffness=200.0, damping=1.0)
    t = np.arange(200) / 100.0
    decay, omega = 0.25, np.sqrt(100.0 - 0.25**2)
    exact = np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    coarse, fine = (np.max(np.abs(released(p, n) - exact)) for n in (10, 20))
    assert fine < 2e-5
    assert coarse / fine == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize(
    ("ratio", "tolerance"),
    [(0.0, 1e-6), (0.02, 5e-5)],  # second order, but first in the dashpot of the carried mass
)
def test_carried_mass_and_relaxation_are_those_of_an_independent_integrator(ratio, tolerance):
    p = Properties(
        mass=2.0, stiffness=200.0, damping=1.0, relaxing_stiffness=100.0, relaxation_time=0.05,
        carried_mass=0.5, carried_omega=15.0, carried_ratio=ratio,
    )  # fmt: skip

    def rate(_, s):
        x, v, w, y, u = s
        pull = 0.5 * (15.0**2 * (y - x) + 2.0 * ratio * 15.0 * (u - v))
        return [v, (pull - 200.0 * x - v - 100.0 * w) / 1.5, v - w / 0.05, u, -pull / 0.5]

    t = np.arange(200) / 100.0
    exact = solve_ivp(rate, (0.0, 2.0), [1.0, 0.0, 0.0, 1.0, 0.0], t_eval=t, rtol=1e-11, atol=1e-12).y[0]
    np.testing.assert_allclose(released(p, 100), exact, rtol=0.0, atol=tolerance)


def test_dry_friction_holds_exactly():
    p = Properties(mass=2.0, stiffness=200.0, coulomb=5.0)
    load = 4.99 * np.sin(np.arange(200.0))
    assert not march(p, load, 100.0, 10, 0.0, Drive()).displacement.any()


def test_bouc_wen_force_saturates_where_its_rate_is_zero():
    p = Properties(bouc_wen_stiffness=4.0e5, bouc_wen_beta=1.4, bouc_wen_gamma=0.87, bouc_wen_exponent=2.0)
    x = np.linspace(0.0, 0.01, 2001)
    force = component_force(p, x, np.full(2001, 0.1), 100.0, 200)
    assert force[-1] == pytest.approx(np.sqrt(4.0e5 / 2.27), rel=1e-6)


def test_cases_are_complete():
    assert [case.number for case in CASES] == list(range(24))
    assert len({case.name for case in CASES}) == 24
    known = {effect.name for effect in CATALOGUE}
    for case in CASES:
        assert known >= {*case.also, *(name for group in case.right for name in group)}, case.name
        assert case.complete(1.0).properties != case.complete().properties, case.name


def test_a_case_is_read_as_meant(tmp_path):
    case = next(case for case in CASES if case.name == "second_door_closer_two_valves")
    rng = np.random.default_rng([1, case.number])
    one = made(case, rng)
    write_case(one, tmp_path, rng)
    read = read_case(tmp_path)
    assert len(read.identification) == 3
    assert read.channel("angle").noise_std is None
    seen = read.validation[0].values["angle"]
    degrees = 1.0 if read.channel("angle").unit == "rad" else 180.0 / np.pi
    meant = [degrees * signals["displacement"] for signals in one.signals]
    assert np.std(seen - meant[-1]) == pytest.approx(0.003 * np.std(np.concatenate(meant)), rel=0.1)
    assert 0.0 < one.sizes.background < one.sizes.effect
    told = acceptance([one])["cases"][case.name]
    assert told["right"] == [["asymmetric_damping"]]
    assert 0.0 < told["nrmse"] < one.sizes.fitted
