"""Rewards that follow identification: the expected error with a background, and the contrastive bound."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from bench.errors import ParameterError
from bench.excitation import Family, estimate, fans
from bench.excitation.background import SETTINGS, errors_left, expected_error, with_background
from bench.excitation.closed_loop import disturbances, run_commands
from bench.excitation.contrastive import contrastive_bound, local_contrasts
from envs.background import background_of
from envs.options import Options
from envs.practice import PracticeBenches
from envs.setups import discrimination_setup, joint_setup, sdof_setup

SETUP = sdof_setup()
STATION = SETUP.station()
NOISE = np.array([STATION.noise[name] for name in STATION.channels])


def test_expected_error_is_that_of_a_linear_problem(rng: np.random.Generator) -> None:
    """Posterior means of a linear model with a force that it lacks, over many draws of parameters and noise."""
    p, n, draws = 3, 40, 40_000
    slopes, besides = 0.3 * rng.standard_normal((n, p)), 0.5 * rng.standard_normal(n)
    x = rng.uniform(-math.sqrt(3.0), math.sqrt(3.0), (draws, p))
    y = x @ slopes.T + besides + rng.standard_normal((draws, n))
    found = np.linalg.solve(np.eye(p) + slopes.T @ slopes, slopes.T @ y.T).T
    said = float(expected_error(slopes.T @ slopes, slopes.T @ besides))
    # the standard error of a mean square over so many draws is below a percent
    assert math.sqrt(float(np.mean((found - x) ** 2))) == pytest.approx(said, rel=0.01)


def test_contrastive_bound_comes_near_the_information_of_a_linear_problem(rng: np.random.Generator) -> None:
    """A normal parameter measured with normal noise: the information is ``log(1 + precision) / 2``, and the bound stays below it."""
    draws, contrasts, precision = 20_000, 511, 8.0
    x, others = rng.standard_normal(draws), rng.standard_normal((draws, contrasts))
    y = x + rng.standard_normal(draws) / math.sqrt(precision)
    said = contrastive_bound(-0.5 * precision * (y - x) ** 2, -0.5 * precision * (y[:, None] - others) ** 2)
    information = 0.5 * math.log1p(precision)
    error = float(np.std(said)) / math.sqrt(draws)
    assert information - 0.02 < said.mean() < information + 3.0 * error
    assert said.max() <= math.log(contrasts + 1.0)


def test_local_contrasts_are_exchangeable_with_the_rig(rng: np.random.Generator) -> None:
    """Rig and contrast come from the same narrowed prior: both lie in the range, and are distributed alike."""
    x = rng.uniform(-math.sqrt(3.0), math.sqrt(3.0), (20_000, 1))
    near = local_contrasts(x, 0.5, 1, rng)[:, 0]
    assert np.max(np.abs(near)) <= math.sqrt(3.0)
    for power in (2, 4):  # 1 and 9/5, with a standard error of some 0.01
        assert np.mean(near**power) == pytest.approx(np.mean(x**power), abs=0.05)
    assert np.mean((near - x) ** 2) < 2.0 * 0.5**2


@pytest.mark.parametrize("setup", [SETUP, joint_setup()], ids=["sdof", "joint"])
def test_reward_is_the_expected_error_of_the_rig_with_its_background(setup) -> None:
    n, windows = 2, 60
    benches = PracticeBenches(setup, Options(enforcement="cost", penalty=0.0, reward="error"), n)
    places, station = np.arange(n), benches.station
    benches.reset(places, [np.random.default_rng(i) for i in range(n)])
    actions = 0.9 * np.sin(0.4 * np.arange(windows))[:, None, None] * np.ones((windows, n, benches.width))
    total = np.zeros(n)
    for window, action in enumerate(actions):
        if window == windows // 2:
            benches = pickle.loads(pickle.dumps(benches))
        total += benches.step(places, action).reward
    draw = benches.truth[0]
    assert draw is not None
    hypothesis = setup.questions[0].hypotheses[0]
    naive = Family(hypothesis, station.channels, station.actuators)
    real = Family(with_background(hypothesis, background_of(setup)), station.channels, station.actuators)
    desk = PracticeBenches(setup, Options(), 1).desk
    u = np.concatenate([desk.commands(np.zeros(1, dtype=int), action[:1])[0] for action in actions], axis=1)
    x, noise = draw.coordinates[None], np.array([station.noise[name] for name in station.channels])
    p = naive.n_parameters
    y = naive.record(fans(x[:, :p], SETTINGS.step), u)[0] / noise
    slopes = ((y[1:] - y[0]) / SETTINGS.step).reshape(p, -1)
    besides = (real.record(x[:, None], u)[0, 0] / noise - y[0]).ravel()
    blind, knowing = (
        -float(np.log(expected_error(slopes @ slopes.T, slopes @ part))) for part in (0.0 * besides, besides)
    )
    assert total[0] == pytest.approx(knowing, rel=1e-6)
    assert knowing < blind - 1e-3  # the background shows


def test_errors_left_are_those_over_many_backgrounds(rng: np.random.Generator) -> None:
    """Against the mean over drawn backgrounds, each run as it is, of a rig with friction, whose motion is not chaotic."""
    hypothesis = SETUP.questions[0].hypotheses[2]  # type: ignore[union-attr]
    family = Family(hypothesis, STATION.channels, STATION.actuators)
    real = Family(with_background(hypothesis, background_of(SETUP)), STATION.channels, STATION.actuators)
    x, clock = np.array([0.3, -0.5, 0.8]), np.arange(STATION.n_samples) * STATION.timestep
    u = 1.2 * np.sin(2.0 * np.pi * np.array([1.2, 1.5])[:, None] * clock)[..., None]
    found = errors_left(real, x, u, NOISE)
    y = family.record(np.broadcast_to(fans(x, SETTINGS.step), (2, 4, 3)), u)
    np.testing.assert_allclose(found.motion, y[:, 0], atol=1e-12)  # sums in another order
    slopes = ((y[:, 1:] - y[:, :1]) / (SETTINGS.step * NOISE)).reshape(2, 3, -1)
    information = slopes @ slopes.transpose(0, 2, 1)
    np.testing.assert_allclose(found.bare, expected_error(information, np.zeros((2, 3))), rtol=1e-9)
    drawn = rng.uniform(-math.sqrt(3.0), math.sqrt(3.0), (400, 3))
    points = np.concatenate([np.tile(x, (len(drawn), 1)), drawn], axis=1)
    besides = ((real.record(np.tile(points, (2, 1, 1)), u) - y[:, :1]) / NOISE).reshape(2, len(drawn), -1)
    score = np.einsum("kpt,kbt->kbp", slopes, besides)
    square = np.mean(expected_error(information[:, None], score) ** 2, axis=1)
    # 400 draws tell a mean square to some 5 %; the record is not quite linear in the background
    np.testing.assert_allclose(found.backed, np.sqrt(square), rtol=0.15)
    alone = errors_left(family, x, u, NOISE)
    np.testing.assert_array_equal(alone.backed, alone.bare)


@pytest.mark.slow
def test_expected_error_is_near_what_identification_leaves() -> None:
    """Over rigs with friction, of which the linearisation holds, within a factor of two on every one."""
    hypothesis = SETUP.questions[0].hypotheses[2]  # type: ignore[union-attr]
    family = Family(hypothesis, STATION.channels, STATION.actuators)
    real = Family(with_background(hypothesis, background_of(SETUP)), STATION.channels, STATION.actuators)
    rng, n, repeats = np.random.default_rng(3), 6, 6
    x = rng.uniform(-1.5, 1.5, (n, 3))
    there = np.concatenate([x, rng.uniform(-1.5, 1.5, (n, 3))], axis=1)
    u = (
        1.2
        * np.sin(2.0 * np.pi * np.cumsum(np.linspace(1.2, 2.6, STATION.n_samples)) * STATION.timestep)[
            :, None
        ]
    )
    square = np.zeros(n)
    for _ in range(repeats):
        runs = run_commands(STATION, u, real.packed(there), disturbances(STATION, n, rng))
        square += np.mean((estimate(family, runs.records, NOISE).coordinates - x) ** 2, axis=1) / repeats
    y = family.record(fans(x, SETTINGS.step), np.broadcast_to(u, (n, *u.shape)).copy()) / NOISE
    inside = np.arange(STATION.n_samples) < runs.records.lengths[:, None]
    y = np.where(inside[:, None, :, None], y, 0.0)
    slopes = ((y[:, 1:] - y[:, :1]) / SETTINGS.step).reshape(n, 3, -1)
    besides = (np.where(inside[..., None], runs.ideal / NOISE, 0.0) - y[:, 0]).reshape(n, -1)
    said = expected_error(slopes @ slopes.transpose(0, 2, 1), np.einsum("npt,nt->np", slopes, besides))
    assert np.all(np.abs(np.log(said / np.sqrt(square))) < math.log(2.0))


def test_rivals_have_no_error() -> None:
    with pytest.raises(ParameterError, match="information"):
        PracticeBenches(discrimination_setup("sdof", ("gap_cubic",), 2), Options(reward="error"), 1)
