"""Coverage of states and memory: what counts as a visit, what is chosen, and the reward of the environments."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import envs
from bench.errors import ParameterError
from bench.excitation import Coverage, CoverageSettings

ONE = np.zeros(1, dtype=np.int64)
T = np.arange(0.0, 8.0, 0.01)


def tone(amplitude: float, frequency: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity (n, 1) of a sine that grows from rest."""
    x = amplitude * np.minimum(T, 1.0) * np.sin(2.0 * np.pi * frequency * T)
    return x[:, None], np.gradient(x, T)[:, None]


def worth(*motions: tuple[np.ndarray, np.ndarray], settings: CoverageSettings | None = None) -> float:
    books = Coverage([1.0], [10.0], settings=settings)
    for x, v in motions:
        books.rest(ONE)
        books.take(ONE, x[None], v[None])
    return float(books.merit[0])


def test_merit_is_that_of_entries_however_the_record_is_cut() -> None:
    x, v = tone(0.8)
    whole, cut = Coverage([1.0], [10.0]), Coverage([1.0], [10.0])
    total = whole.take(ONE, x[None], v[None])
    parts = [cut.take(ONE, a[None], b[None]) for a, b in zip(np.split(x, 8), np.split(v, 8), strict=True)]
    assert np.sum(parts) == pytest.approx(total[0], rel=1e-12)
    assert cut.merit == pytest.approx(whole.merit, rel=1e-12)
    # log(1 + n) of the entries of every cell
    assert total[0] == pytest.approx(float(np.sum(np.log1p(whole._counts))), rel=1e-9)
    # staying tells nothing: twice the samples of the same motion
    slow = np.repeat(x, 2, axis=0), np.repeat(v, 2, axis=0)
    assert worth(slow) == pytest.approx(worth((x, v)))


def test_memory_tells_motions_through_the_same_states_apart() -> None:
    # one goes to and fro over the whole range, the other also turns half-way: the same places and speeds, another past
    up = np.concatenate([np.linspace(-0.9, 0.9, 400), np.linspace(0.9, -0.9, 400)])
    turns = np.concatenate([up, np.linspace(-0.9, 0.0, 200), np.linspace(0.0, -0.9, 200)])
    again = np.concatenate([up, np.linspace(-0.9, 0.9, 200), np.linspace(0.9, -0.9, 200)])
    grown = {}
    for name, x in (("turns", turns), ("again", again)):
        v = np.where(np.gradient(x) > 0.0, 1.0, -1.0)
        books = Coverage([1.0], [10.0])
        books.take(ONE, x[None, :800, None], v[None, :800, None])
        before = books.visited()[0]
        books.take(ONE, x[None, 800:, None], v[None, 800:, None])
        grown[name] = books.visited()[0] - before
    assert grown["turns"] > grown["again"]


def test_what_was_not_covered_is_chosen_first() -> None:
    motions = [tone(0.8), tone(0.8), tone(0.3, 3.0), tone(0.05)]
    books = Coverage([1.0], [10.0])
    assert books.most_covering(motions, 2, after=[motions[0]]) == (2, 0)
    assert books.merit[0] == pytest.approx(worth(motions[0], motions[2], motions[0]))
    with pytest.raises(ParameterError, match="5 of 4"):
        books.most_covering(motions, 5)
    with pytest.raises(ParameterError, match="half-ranges"):
        Coverage([1.0, 1.0], [10.0])
    with pytest.raises(ParameterError, match="odd"):
        CoverageSettings(states=4)


def test_reward_of_coverage_pays_for_motion_and_hardly_for_noise() -> None:
    earned = {}
    for push in (0.0, 1.0):
        env = gymnasium.make(envs.IDS[0], reward="coverage", enforcement="cost", penalty=0.0).unwrapped
        env.reset(seed=4)
        total = 0.0
        for step in range(150):
            _, reward, *_, info = env.step(np.array([push * np.sin(0.5 * step)], dtype=np.float32))
            total += reward
        assert total == pytest.approx(info["merit"])
        earned[push] = total
    assert earned[0.0] < 0.1 * earned[1.0]
    env.reset(seed=4)  # anew: what was visited before counts no more
    assert env.step(np.zeros(1, dtype=np.float32))[4]["merit"] < 0.1 * earned[1.0]
    with pytest.raises(ParameterError, match="rivals"):
        gymnasium.make(envs.IDS[2], reward="coverage", terminate_when_certain=True)
