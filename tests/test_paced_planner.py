"""A planner that spreads its work over the windows of a test, and the identification that it follows the rig by."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bench.cli import main
from bench.errors import ParameterError
from bench.excitation import Family, PacedPlanner, Planner, estimate
from bench.excitation.background import errors_left, with_background
from bench.excitation.closed_loop import disturbances, run_commands, run_policy
from bench.excitation.estimation import normal_equations
from bench.excitation.following import Bank, Follower
from bench.excitation.known_rig import KnownRig
from bench.excitation.shaping import through_knots
from bench.excitation.station import Desk
from envs.background import background_of
from envs.setups import joint_setup, sdof_setup

SETUP = sdof_setup()
STATION = SETUP.station()
PRIOR = SETUP.questions[0]
FAMILIES = tuple(Family(h, STATION.channels, STATION.actuators) for h in PRIOR.hypotheses)
NOISE = np.array(list(SETUP.noise.values()))
EXAMPLE = Path(__file__).parent.parent / "examples" / "excite.toml"


def sweep() -> np.ndarray:
    """Through all resonances of the prior, upwards."""
    frequency = np.linspace(1.2, 2.6, STATION.n_samples)
    return 0.8 * np.sin(2.0 * np.pi * np.cumsum(frequency) * STATION.timestep)[:, None]


def rigs(family: Family, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.6, 1.6, (n, family.n_parameters))


def noise_of(n: int, seed: int = 1) -> np.ndarray:
    return disturbances(STATION, n, np.random.default_rng(seed))


@pytest.mark.parametrize("kind", range(3))
def test_following_comes_to_what_an_identification_of_the_whole_record_finds(kind: int) -> None:
    runs = run_commands(STATION, sweep(), FAMILIES[kind].packed(rigs(FAMILIES[kind], 3)), noise_of(3))
    banks = tuple(map(Bank.of, FAMILIES, PRIOR.weights))
    found = estimate(FAMILIES[kind], runs.records, NOISE)
    for i in range(3):
        follower = Follower(banks, NOISE, STATION.n_samples, 1)
        for window in range(STATION.n_windows):
            span = slice(4 * window, 4 * window + 4)
            follower.append(runs.records.controls[i, span], runs.records.measured[i, span])
            if window < 60:
                follower.run_banks()
            follower.improve(window % 3)
        assert next(iter(follower.log_odds())) == kind
        ours = follower.found[kind]
        assert ours is not None
        assert (
            ours.cost < found.cost[i] + 1.0
        )  # at times far below: a record that grows leads past other valleys


def test_what_is_cut_off_in_what_is_shown_misleads_nobody() -> None:
    runs = run_commands(STATION, 1.6 * sweep(), FAMILIES[0].packed(rigs(FAMILIES[0], 4)), noise_of(4))
    shown = np.array([0.04, 0.6, 3.0])  # of accelerations up to ten times that
    assert np.max(np.abs(runs.records.measured[:, :, 2])) > 6.0
    banks = tuple(map(Bank.of, FAMILIES, PRIOR.weights))
    off = np.zeros((4, 2))
    for i, x in enumerate(rigs(FAMILIES[0], 4)):
        for k, limit in enumerate((shown, np.inf)):
            follower = Follower(banks, NOISE, STATION.n_samples, 1, 0, limit)
            for window in range(STATION.n_windows):
                span = slice(4 * window, 4 * window + 4)
                seen = np.clip(runs.records.measured[i, span], -shown, shown)
                follower.append(runs.records.controls[i, span], seen)
                if window < 60:
                    follower.run_banks()
                follower.improve(0)
            found = follower.found[0]
            assert found is not None
            off[i, k] = np.sqrt(np.mean((found.x - x) ** 2))
    assert np.max(off[:, 0]) < 0.1
    assert np.mean(np.log(off[:, 0])) < np.mean(np.log(off[:, 1])) - 0.7


def test_what_a_rest_is_expected_to_leave_is_what_planners_expect() -> None:
    family, x = FAMILIES[1], rigs(FAMILIES[1], 1)[0]
    knots = 0.4 * np.sin(np.linspace(0.0, 25.0, 120))[None, :, None]
    follower = Follower(tuple(map(Bank.of, FAMILIES, PRIOR.weights)), NOISE, STATION.n_samples, 1)
    follower.append(sweep()[:320], np.zeros((320, 3)))
    errors, made = KnownRig(family, x, Desk(STATION, 1), follower).weigh(knots, follower)
    whole = np.concatenate([sweep()[:320], 2.0 * through_knots(made, sweep()[None, 319] / 2.0, 4)[0]])
    planner = Planner(PRIOR, STATION, sweep())
    theirs, fitted = planner._weigh(1, x, whole, whole[None, 320:])
    np.testing.assert_allclose(fitted[0], whole[320:], rtol=0.02)  # within the limits as it is
    information, _ = normal_equations(
        family,
        run_commands(STATION, whole, family.packed(x[None]), 0.0 * noise_of(1)).records,
        x[None],
        NOISE,
    )
    asked = np.sqrt(np.trace(np.linalg.inv(np.eye(5) + information[0])) / 5)
    assert errors[0] == pytest.approx(asked, rel=1e-3)
    assert errors[0] == pytest.approx(theirs[0], rel=0.1)


def test_with_a_background_a_rest_is_expected_to_leave_what_both_leave() -> None:
    terms, x = background_of(SETUP), rigs(FAMILIES[2], 1)[0]
    real = Family(with_background(FAMILIES[2].hypothesis, terms), STATION.channels, STATION.actuators)
    follower = Follower(tuple(map(Bank.of, FAMILIES, PRIOR.weights)), NOISE, STATION.n_samples, 1)
    follower.append(sweep()[:320], np.zeros((320, 3)))
    knots = 0.2 * np.sin(np.linspace(0.0, 25.0, 120))[None, :, None]
    errors, made = KnownRig(real, x, Desk(STATION, 1), follower).weigh(knots, follower)
    whole = np.concatenate([sweep()[:320], 2.0 * through_knots(made, sweep()[None, 319] / 2.0, 4)[0]])
    left = errors_left(real, x, whole[None], NOISE)
    assert errors[0] == pytest.approx(
        left.backed[0], rel=0.05
    )  # terms by their slopes, there at one deviation
    assert errors[0] > 1.2 * left.bare[0]


@pytest.mark.slow
def test_it_leaves_less_than_its_opening_within_the_limits_and_from_what_is_measured_only() -> None:
    family, x = FAMILIES[2], rigs(FAMILIES[2], 6, seed=3)
    planner, noise = PacedPlanner(PRIOR, STATION, sweep()), noise_of(6)
    tests = planner.memory(6)
    runs = run_policy(planner, family.packed(x), noise, memory=tests)
    opening = run_commands(STATION, sweep(), family.packed(x), noise)
    left = [np.abs(estimate(family, item.records, NOISE).coordinates - x) for item in (runs, opening)]
    assert np.mean(np.log(left[0])) < np.mean(np.log(left[1])) - 0.7  # less than half; found: a fifth
    assert np.max(runs.reached) <= 1.0
    assert np.max(runs.energy) <= 1.0 + 1e-9
    assert all(test.expected is not None and test.weighed > 200 for test in tests)
    np.testing.assert_allclose(runs.records.controls[:, :160], opening.records.controls[:, :160], atol=0.12)
    alone = run_policy(planner, family.packed(x[:1]), noise[:1])
    np.testing.assert_array_equal(alone.records.controls[0], runs.records.controls[0])


@pytest.mark.parametrize("loads", [1, 2])
def test_it_takes_two_loads_and_several_knots_a_window_in_a_short_test(loads: int) -> None:
    setup = sdof_setup() if loads == 1 else joint_setup()
    station = setup.station(n_windows=40, n_knots=2)
    family = Family(setup.questions[0].hypotheses[0], station.channels, station.actuators)
    planner = PacedPlanner(setup.questions[0], station, np.zeros((station.n_samples, loads)))
    tests = planner.memory(2)
    runs = run_policy(
        planner,
        family.packed(rigs(family, 2)),
        disturbances(station, 2, np.random.default_rng(0)),
        memory=tests,
    )
    assert all(test.window == 40 and test.weighed for test in tests)
    assert np.all(np.any(runs.records.controls[:, 40:] != 0.0, axis=1))  # from an opening of nothing
    assert np.max(runs.energy) <= 1.0 + 1e-9
    assert np.max(runs.reached) <= 1.0


def test_it_says_what_it_cannot_take() -> None:
    with pytest.raises(ParameterError, match="finite commands"):
        PacedPlanner(PRIOR, STATION, sweep()[:-1])
    with pytest.raises(ParameterError, match="amplitude_frequency"):
        PacedPlanner(PRIOR, SETUP.station(shaping="amplitude_frequency"), sweep())
    planner = PacedPlanner(PRIOR, STATION, sweep())
    seen = np.zeros((2, STATION.n_observations), dtype=np.float32)
    with pytest.raises(ParameterError, match="observations of length"):
        planner.act(seen[:, :-1], planner.memory(2))
    with pytest.raises(ParameterError, match=r"memory = policy\.memory"):
        planner.act(seen)
    memory = planner.memory(2)
    for test in memory:
        test.window = STATION.n_windows
    with pytest.raises(ParameterError, match="are over"):
        planner.act(seen, memory)


@pytest.mark.slow
def test_excite_plans_at_the_pace_of_the_test(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rest = ["--evaluations", "64", "--draws", "2", "-o", str(tmp_path / "e.csv"), "--json"]
    assert main(["excite", str(EXAMPLE), "--method", "paced", *rest]) == 0
    told = json.loads(capsys.readouterr().out)
    assert any("gap.clearance" in note for note in told["notes"])
    assert any("decided every 0.04 s" in note for note in told["notes"])
    assert max(share for entries in told["peaks"].values() for share in entries.values()) <= 1.0 + 1e-9
