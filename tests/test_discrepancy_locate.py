"""Where the gap lies: regions of the missing force, times, and sensors told apart from forces."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.discrepancy import Case, CaseChannel, NominalParameter, record_from_arrays
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.bounded_force import limited_regions
from bench.discrepancy.localisation.force_smoother import observers
from bench.discrepancy.localisation.law_regions import acting_regions
from bench.discrepancy.localisation.localise import locate
from bench.discrepancy.localisation.parity_relations import contradictions
from bench.discrepancy.localisation.state_map import CELLS, state_maps
from bench.discrepancy.localisation.state_splits import force_splits
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.search.forward_selection import attribute

MASS, DAMPING, STIFFNESS = 2.0, 4.0, 1500.0
RATE, N = 1000.0, 10_000


def problem(
    force_of, *, noise: float = 0.005, spoil=lambda x: x, seed: int = 0, wrong: float = 0.0
) -> Problem:
    """An sdof record with a force ``force_of(t, x, v)`` that the nominal model lacks; `spoil` acts on the displacement channel.

    Semi-implicit Euler with twenty steps a sample: none of the project's integrators.
    """
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft(rng.standard_normal(N))
    spectrum[np.fft.rfftfreq(N, 1 / RATE) > 8.0] = 0.0
    load = np.fft.irfft(spectrum, N)
    load *= 20.0 / np.std(load) * np.minimum(np.arange(N) / 200.0, 1.0)
    x = v = 0.0
    out = np.zeros((2, N))
    h = 1.0 / (20 * RATE)
    for k in range(N):
        end = load[min(k + 1, N - 1)]
        f = load[k]
        out[0, k] = x
        out[1, k] = (f - DAMPING * v - STIFFNESS * x - force_of(k / RATE, x, v)) / MASS
        for s in range(20):
            f = load[k] + (end - load[k]) * s / 20
            v += h * (f - DAMPING * v - STIFFNESS * x - force_of(k / RATE, x, v)) / MASS
            x += h * v
    clean = {"force": load, "displacement": spoil(out[0]), "acceleration": out[1]}
    stds = {name: noise * float(np.std(y)) for name, y in clean.items()}
    time = np.arange(N) / RATE
    record = record_from_arrays(
        "identification", time, {name: y + stds[name] * rng.standard_normal(N) for name, y in clean.items()}
    )
    units = {"force": "N", "displacement": "m", "acceleration": "m/s^2"}
    nominal = (
        NominalParameter("mass", MASS, 0.01 * MASS, "kg"),
        NominalParameter("damping", DAMPING, 0.2 * DAMPING, "N s/m"),
        NominalParameter("stiffness", STIFFNESS * (1 + wrong), 0.03 * STIFFNESS, "N/m"),
    )
    channels = tuple(
        CaseChannel(name, units[name], "measured" if name == "force" else "response", stds[name])
        for name in clean
    )
    case = Case("planted", "sdof", nominal, channels, (record,), (record,))
    return Problem(case, structure_of(case), (record,))


def nothing(t: float, x: float, v: float) -> float:
    return 0.0


def stop(t: float, x: float, v: float) -> float:
    return 2000.0 * max(x - 0.01, 0.0)


def snap(t: float, x: float, v: float) -> float:
    inside = max(1.0 - (x / 0.06) ** 2, 0.0)
    return -400.0 * x * inside**2


def dry(t: float, x: float, v: float) -> float:
    return 2.0 * np.tanh(v / 0.001)


def unexplained(case: Problem) -> Explanation:
    return Explanation(((case, fit(case, (), start=np.zeros(len(case.nominal)))),))


@pytest.mark.parametrize("wrong", [-0.04, 0.04])
def test_a_force_within_a_window_is_told_from_one_outside_it_by_free_runs(wrong):
    # a stiffness that is off makes a force of opposite sign outside the window of the one within
    nominal = unexplained(problem(snap, wrong=wrong))
    found = limited_regions(nominal, nominal)
    ((region,),) = found.values()
    low, high = region["displacement"]
    # a cell is a 24th of a stroke of some 310 mm, and the force has all but gone at the last fifth of the window
    assert -0.06 - 0.013 < low < -0.048 + 0.013
    assert 0.048 - 0.013 < high < 0.06 + 0.013
    assert region["share"] == pytest.approx(1.0)


def test_a_force_on_one_side_has_one_region_that_ends_where_the_motion_does():
    case = problem(stop)
    nominal = unexplained(case)
    ((region,),) = limited_regions(nominal, nominal).values()
    reach = np.abs(case.motion(0).position).max()
    # a cell and a half, a 24th of the stroke each: straight lines between cells bend early
    assert region["displacement"][0] == pytest.approx(0.01, abs=1.5 * reach / 12)
    assert region["displacement"][1] == pytest.approx(reach, rel=1e-6)
    assert region["force"] > 0.0


@pytest.mark.parametrize("force_of", [nothing, dry])
def test_no_region_where_nothing_is_missing_or_something_everywhere(force_of):
    nominal = unexplained(problem(force_of))
    assert limited_regions(nominal, nominal) == {}


def test_the_missing_force_is_estimated_sample_by_sample():
    case = problem(stop)
    (observer,) = observers(case)
    estimate = observer.estimate(case.records[0], observer.nominal(), noise=1)
    truth = 2000.0 * np.maximum(estimate.position[:, 0] - 0.01, 0.0)
    left = np.std(estimate.force[200:, 0] - truth[200:])
    # the mass of half a percent of acceleration noise, and as much of the load, before smoothing
    unsmoothed = 0.005 * np.hypot(
        np.std(case.records[0].values["force"]), MASS * np.std(case.records[0].values["acceleration"])
    )
    assert left < unsmoothed
    assert 0.3 < np.std(estimate.noise[0]) / left < 1.5  # the pass of noise alone tells the size of the error


def test_a_one_sided_stop_is_found_on_its_side_of_the_displacement_with_the_stiffness_wrong():
    case = problem(stop, wrong=0.03)
    (found,) = state_maps(case, case.records)
    region = found.regions[0]
    assert region.velocity is None
    assert region.displacement is not None
    width = found.displacement_edges[1] - found.displacement_edges[0]
    assert region.displacement[0] == pytest.approx(
        0.01, abs=1.1 * width
    )  # an edge of the cell the stop begins in
    assert region.force > 0.0
    assert region.share > 0.9


def test_nothing_missing_leaves_no_region_though_the_stiffness_is_wrong_within_its_uncertainty():
    case = problem(nothing, wrong=0.04)
    (found,) = state_maps(case, case.records)
    assert found.regions == ()
    assert not found.active[0].any()


def test_a_force_of_some_seconds_is_found_in_time():
    case = problem(lambda t, x, v: 15.0 if 4.0 < t < 6.0 else 0.0)
    (found,) = state_maps(case, case.records)
    edges = found.times[0]
    marked = edges[:-1][found.active[0]]
    width = edges[1] - edges[0]
    assert marked.min() == pytest.approx(4.0, abs=1.1 * width)
    assert marked.max() == pytest.approx(6.0 - width, abs=1.1 * width)


def test_shares_add_up_and_contact_holds_the_force_of_a_stop():
    case = problem(stop)
    maps = state_maps(case, case.records)
    splits = force_splits(case, case.records, maps)
    assert {s.kind for s in splits} == {
        "displacement", "velocity", "after_reversal", "band_hz", "time_s", "contact",
    }  # fmt: skip
    for split in splits:
        assert sum(split.shares) == pytest.approx(1.0)
        assert len(split.shares) == len(split.p_values) == len(split.significant)
    contact = next(s for s in splits if s.kind == "contact")
    assert contact.shares[0] > 0.95
    assert maps[0].share.shape == (CELLS, CELLS)
    assert maps[0].share.sum() == pytest.approx(1.0)


def late(x: NDArray) -> NDArray:
    """Ten milliseconds of delay."""
    return np.concatenate([np.zeros(10), x[:-10]])


@pytest.mark.parametrize(
    ("force", "spoil", "fault"),
    [(stop, lambda x: x, False), (nothing, late, True), (nothing, lambda x: 1.1 * x, True), (nothing, lambda x: x, False)],
    ids=["force", "delay", "gain", "clean"],
)  # fmt: skip
def test_channels_contradict_each_other_where_a_sensor_is_at_fault_and_only_there(force, spoil, fault):
    (found,) = contradictions(problem(force, spoil=spoil))
    assert found.channels == ("displacement", "acceleration")
    assert found.found is fault
    if fault:
        assert found.suspect in {"displacement", ""}


def test_friction_which_makes_the_acceleration_jump_is_no_fault_of_a_sensor():
    (found,) = contradictions(problem(lambda t, x, v: 3.0 * np.tanh(v / 1e-3)))
    assert not found.found


def test_a_named_stop_tells_where_it_begins_better_than_the_map():
    case = problem(stop, wrong=0.03)
    candidates = [e for e in CATALOGUE if e.name == "one_sided_stop"]
    search = attribute(case, placements(case.case, case.structure, candidates), most=1)
    best = Explanation(((case, search.ranked()[0]),))
    (region,) = acting_regions(best)[""]
    assert region["effect"] == "one_sided_stop"
    # the fit knows the position to some micrometres
    assert region["displacement"][0] == pytest.approx(0.01, abs=1e-4)
    assert "velocity" not in region
    assert region["force"] > 0.0


def test_a_named_stop_tells_its_region_beside_a_faulty_sensor_and_a_smooth_spring_has_none():
    case = problem(stop, spoil=lambda x: 1.1 * x)
    names = ("one_sided_stop", "displacement_gain_error", "cubic_stiffness")
    candidates = placements(case.case, case.structure, [e for e in CATALOGUE if e.name in names])
    search = attribute(case, candidates, most=2)
    best, nothing = (Explanation(((case, f),)) for f in (search.ranked()[0], search.ranked(0)[0]))
    assert {placed.effect.name for placed in best.hypothesis} == set(names[:2])
    for location in locate(case, nothing, best, borne_out=True, unknown=False).locations:
        assert location.kind == "sensor"
        assert location.state_region["displacement"][0] == pytest.approx(0.01, abs=5e-4)  # 1 to 2 cells
    cubic = next(
        f for f in search.fits.values() if [p.effect.name for p in f.hypothesis] == ["cubic_stiffness"]
    )
    assert acting_regions(Explanation(((case, cubic),))) == {}
