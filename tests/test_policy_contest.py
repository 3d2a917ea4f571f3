"""A contest of excitation methods that was stopped goes on where it was."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from policies import contest

from envs.setups import sdof_setup


@pytest.fixture
def noise_alone(monkeypatch):
    """Two open-loop methods that need no search."""
    station, rng = sdof_setup().station(), np.random.default_rng(0)
    shape = (station.n_samples, len(station.actuators))
    found = {name: 0.3 * rng.standard_normal(shape) for name in ("prbs", "schroeder")}
    monkeypatch.setattr(contest, "open_loop", lambda setup, rng: found)
    return found


def test_contest_goes_on_after_the_last_seed_that_was_done(noise_alone, tmp_path):
    def held(seeds, told=lambda text: None):
        return contest.contest(
            sdof_setup(), {}, seeds=seeds, rigs=3, planner=False, folder=tmp_path, tell=told
        )

    first = held(1)
    kinds = {row["kind"] for row in first}
    assert {(row["method"], row["background"]) for row in first} == {
        (name, backed) for name in noise_alone for backed in (False, True)
    }
    assert len(kinds) == 3
    assert all(row["seed"] == 0 and row["error"] >= 0.0 for row in first)
    told = []
    both = held(2, told.append)
    assert both[: len(first)] == first
    assert {row["seed"] for row in both[len(first) :]} == {1}
    assert not any(text.startswith("seed 0") for text in told)
    # other commands are other methods, whatever their name
    noise_alone["prbs"] = 0.5 * noise_alone["prbs"]
    told.clear()
    held(1, told.append)
    assert any(text.startswith("seed 0") for text in told)
