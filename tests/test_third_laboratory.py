"""Cases of the third laboratory: integrated rightly, graded by names that exist, reproducible, and read as meant."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from bench.discrepancy import read_case
from bench.discrepancy.effects.catalogue import CATALOGUE

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from third_laboratory_cases import joint_rig, oscillator  # noqa: E402
from third_laboratory_cases.catalogue import CASES  # noqa: E402
from third_laboratory_cases.joined import tuned  # noqa: E402
from third_laboratory_cases.linear import axis_response  # noqa: E402
from third_laboratory_cases.logger import Dropouts, Jitter, LostRows, Spikes, Table  # noqa: E402
from third_laboratory_cases.oscillator import Background, Oscillator  # noqa: E402
from third_laboratory_cases.signals import noise_band  # noqa: E402
from third_laboratory_cases.writing import Made, acceptance, write_case  # noqa: E402


def written(name, folder, seed=1):
    """A case as it was made and written to a folder."""
    case = next(case for case in CASES if case.name == name)
    rng = case.generator(seed)
    one = Made(case, case.specimen.simulated(case, rng))
    write_case(one, folder, rng)
    return one


def released(p, h, n=2001, start=1.0):
    """Displacement of an oscillator that is released."""
    return oscillator.march(p, Background(), np.zeros(n), np.zeros(n), h, start).displacement


def test_free_decay_is_that_of_the_exact_solution_to_second_order():
    decay, omega = 0.25, np.sqrt(100.0 - 0.25**2)
    t = np.arange(201) / 100.0
    exact = np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    p = Oscillator(mass=2.0, damping=1.0, stiffness=200.0)
    coarse = np.max(np.abs(released(p, 0.001)[::10] - exact))
    fine = np.max(np.abs(released(p, 0.0005, 4001)[::20] - exact))
    assert fine < 2e-5
    assert coarse / fine == pytest.approx(4.0, rel=0.05)


def test_dry_friction_holds_exactly():
    x = released(Oscillator(mass=2.0, damping=0.0, stiffness=200.0, friction=5.0), 0.001, start=0.0249)
    np.testing.assert_array_equal(x, 0.0249)


def test_joint_rig_moves_as_its_transfer_functions():
    axis, t = tuned(3.0, 2.2, 3.2, 4.6, 0.3), np.arange(10_001) / 1000.0
    load = noise_band(1.0, 8.0)(np.random.default_rng(1), t)
    still = np.zeros(len(load))
    x, _ = joint_rig.march(axis, axis, 0.0, joint_rig.Swing(), load, still, 0.001)
    exact = np.array(axis_response(axis, load, 1000.0)).T
    # of first order in the dashpots: a step of 1 ms is 1 % of their time constants
    np.testing.assert_allclose(x[:, :2], exact, rtol=0.0, atol=0.01 * np.max(np.abs(exact)))
    assert not x[:, 2:].any()


def test_faults_of_a_logger_leave_the_rest_as_it_was():
    t = np.arange(2000) / 500.0
    clean = Table(t, {"x": np.sin(t) + 2.0, "f": np.cos(t)})
    rng = np.random.default_rng(1)
    dropped = Dropouts("x", 7).logged(rng, clean).columns["x"]
    assert 4 <= np.sum(dropped == 0.0) <= 7 * 29
    spiked = Spikes("f", 5, 8.0, 8.0).logged(rng, clean).columns["f"]
    off = np.abs(spiked - clean.columns["f"])
    np.testing.assert_allclose(off[off > 0.0], 8.0 * np.std(clean.columns["f"]), rtol=1e-9)
    logged = LostRows(5).logged(rng, Jitter(0.06).logged(rng, clean))
    assert 1995 <= len(logged.t) < 2000
    # between samples it interpolates, to h^2 / 8 of the curvature; the last may lie beyond them
    np.testing.assert_allclose(logged.columns["f"][:-1], np.cos(logged.t[:-1]), rtol=0.0, atol=1e-6)


def test_cases_are_graded_by_names_that_exist():
    assert len({case.name for case in CASES}) == 24
    known = {effect.name for effect in CATALOGUE}
    for case in CASES:
        names = {name.split("@")[0] for group in case.right for name in group}
        assert known >= {*case.also, *names}, case.name


def test_a_case_is_read_as_meant(tmp_path):
    one = written("third_machine_rotary_coupling", tmp_path)
    read = read_case(tmp_path)
    assert len(read.identification) == 2
    assert read.channel("torque").noise_std is None
    meant = [signals["force"] for signals in one.simulated.signals.values()]
    seen = read.validation[0].values["torque"]
    assert np.std(seen - meant[-1]) == pytest.approx(0.005 * np.std(np.concatenate(meant)), rel=0.1)
    sizes = one.simulated.sizes
    assert 0.0 < sizes.background < sizes.left <= sizes.effect
    told = acceptance([one])["cases"][one.case.name]
    assert told["right"] == [["power_law_damping"]]
    assert 0.0 < told["nrmse"] < sizes.left


def test_a_run_is_reproducible(tmp_path):
    for folder, seed in (("one", 1), ("again", 1), ("other", 2)):
        written("third_machine_rotary_coupling", tmp_path / folder, seed)
    one, again, other = (
        (tmp_path / name / "validation.csv").read_text() for name in ("one", "again", "other")
    )
    assert one == again
    assert one != other
    stated = [json.loads((tmp_path / name / "nominal.json").read_text()) for name in ("one", "again")]
    assert stated[0] == stated[1]
