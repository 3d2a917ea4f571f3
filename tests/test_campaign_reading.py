"""Reading campaigns in windows, and exporting rollouts."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import gymnasium
import numpy as np
import pyarrow.dataset as ds
import pytest
from gymnasium import spaces

from bench.campaign import CampaignError, Windows, collect, run_campaign, write_minari
from bench.errors import FileFormatError, ParameterError, UnknownNameError

PLAN = {
    "name": "windows",
    "seed": 3,
    "records": 20,
    "duration": 0.5,
    "sample_rate": 200.0,
    "records_per_part": 5,
    "rigs": [
        {
            "rig": "sdof",
            "timestep": 0.005,
            "structure": {"mass": {"carriage": {"uniform": [1.0, 3.0]}}, "stiffness": {"carriage": 300.0}},
        }
    ],
    "excitations": [{"signals": {"shaker": {"type": "band_limited_noise", "cutoff": 30.0, "rms": 5.0}}}],
    "channels": ["shaker", "displacement", "velocity"],
}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("windows") / "campaign"
    run_campaign(PLAN, folder, threads=1)
    return folder


@pytest.fixture(scope="module")
def table(campaign: Path):
    return ds.dataset(campaign / "samples").to_table()


def test_every_window_comes_once_with_its_own_samples(campaign: Path, table) -> None:
    windows = Windows(
        campaign,
        30,
        stride=20,
        channels=["velocity", "shaker"],
        parameters=["structure/mass/carriage"],
        buffer=2,
    )
    seen = list(windows)
    assert len(windows) == len(seen) == 20 * 4
    assert {(w.record, w.start) for w in seen} == {(r, s) for r in range(20) for s in (0, 20, 40, 60)}
    masses = ds.dataset(campaign / "records").to_table()["structure/mass/carriage"].to_numpy()
    for window in seen[::7]:
        rows = table.slice(int(window.record) * 100 + int(window.start), 30)
        np.testing.assert_array_equal(window.values[:, 0], rows["velocity"].to_numpy())
        np.testing.assert_array_equal(window.values[:, 1], rows["shaker"].to_numpy())
        assert window.parameters[0] == masses[window.record]


def test_order_is_a_function_of_seed_and_epoch(campaign: Path) -> None:
    def order(seed: int, epoch: int) -> list[tuple[int, int]]:
        windows = Windows(campaign, 25, seed=seed, buffer=1)
        windows.set_epoch(epoch)
        return [(int(w.record), int(w.start)) for w in windows]

    first = order(1, 0)
    assert order(1, 0) == first
    assert sorted(first) == sorted(order(1, 1)) == sorted(order(2, 0))
    assert first != order(1, 1)
    assert first != order(2, 0)
    plain = [(int(w.record), int(w.start)) for w in Windows(campaign, 25, shuffle=False)]
    assert plain == sorted(first)


def test_batches_hold_all_windows(campaign: Path) -> None:
    batches = list(Windows(campaign, 50).batches(16))
    assert [batch.values.shape for batch in batches] == [(16, 50, 3), (16, 50, 3), (8, 50, 3)]
    assert len({(r, s) for batch in batches for r, s in zip(batch.record, batch.start, strict=True)}) == 40


def test_memory_does_not_grow_with_the_data_set(tmp_path: Path) -> None:
    peaks = []
    for records in (4, 16):
        folder = tmp_path / str(records)
        # records of 10 000 samples, so that each is a row group of its own: 120 kB of three channels
        run_campaign(PLAN | {"records": records, "duration": 50.0, "records_per_part": 2}, folder)
        windows = Windows(folder, 1000, buffer=2)
        next(iter(windows))  # imports
        found = []
        for _ in range(3):  # other threads allocate too: what they do only adds
            tracemalloc.start()
            assert sum(1 for _ in windows) == 10 * records
            found.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
        peaks.append(min(found))
    # four times the records: the same buffer, give or take the list of row groups
    assert peaks[1] < 1.3 * peaks[0]
    # two records of 120 kB and the next two being read while the old are let go, with Python's own small change
    assert peaks[1] < 1_000_000


@pytest.mark.slow
def test_torch_loader_gets_every_window_once(campaign: Path) -> None:
    from torch.utils.data import DataLoader

    dataset = Windows(campaign, 50, parameters=["structure/mass/carriage"]).torch()
    for workers in (0, 2):
        batches = list(
            DataLoader(
                dataset,
                batch_size=8,
                num_workers=workers,
                multiprocessing_context="spawn" if workers else None,
            )
        )
        assert sum(len(batch["values"]) for batch in batches) == len(dataset) == 40
        assert (
            len({(int(r), int(s)) for b in batches for r, s in zip(b["record"], b["start"], strict=True)})
            == 40
        )
        assert batches[0]["values"].shape[1:] == (50, 3)


def test_mistakes_in_windows_are_named(campaign: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="displacement"):
        Windows(campaign, 10, channels=["displacment"])
    with pytest.raises(UnknownNameError, match="structure/mass/carriage"):
        Windows(campaign, 10, parameters=["mass"])
    for length, stride in ((101, 1), (0, 1), (10, 0)):
        with pytest.raises(ParameterError, match="windows"):
            Windows(campaign, length, stride=stride)
    with pytest.raises(FileFormatError):
        Windows(tmp_path, 10)


class Cart(gymnasium.Env):
    """A mass on a line that is pushed, with an exact next state."""

    observation_space = spaces.Box(-np.inf, np.inf, (2,), np.float64)
    action_space = spaces.Box(-1.0, 1.0, (1,), np.float64)

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        super().reset(seed=seed)
        self.state, self.steps = self.np_random.uniform(-0.5, 0.5, 2), 0
        return self.state.copy(), {}

    def step(self, action):
        self.state = self.state + 0.1 * np.array([self.state[1], action[0]])
        self.steps += 1
        ended = bool(abs(self.state[0]) > 1.0)
        return self.state.copy(), -float(self.state[0] ** 2), ended, self.steps >= 20, {}


def test_rollouts_follow_the_environment_and_their_seed() -> None:
    def policy(observation, rng):
        return rng.uniform(-1.0, 1.0, 1)

    rollouts = collect(Cart(), policy, episodes=4, seed=9)
    again = collect(Cart(), policy, episodes=6, seed=9)
    for episode, same in zip(rollouts, again, strict=False):
        np.testing.assert_array_equal(episode.observations, same.observations)
        n = len(episode.actions)
        expected = episode.observations[:-1] + 0.1 * np.column_stack(
            [episode.observations[:-1, 1], episode.actions[:, 0]]
        )
        np.testing.assert_array_equal(episode.observations[1:], expected)
        assert episode.rewards.shape == episode.terminations.shape == (n,)
        assert episode.terminations[-1] or episode.truncations[-1]
        assert not (episode.terminations[:-1] | episode.truncations[:-1]).any()
    cut = collect(Cart(), policy, episodes=1, seed=9, max_steps=3)[0]
    assert len(cut.actions) == 3
    assert cut.truncations[-1]


@pytest.mark.slow
def test_minari_reads_what_was_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import minari

    rollouts = collect(Cart(), lambda observation, rng: rng.uniform(-1.0, 1.0, 1), episodes=3)
    folder = write_minari("bench/cart/random-v0", rollouts, Cart(), folder=tmp_path, algorithm="random")
    assert folder.is_dir()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    dataset = minari.load_dataset("bench/cart/random-v0")
    assert dataset.total_episodes == 3
    assert dataset.total_steps == sum(len(rollout.actions) for rollout in rollouts)
    for episode, rollout in zip(dataset.iterate_episodes(), rollouts, strict=True):
        np.testing.assert_array_equal(episode.observations, rollout.observations)
        np.testing.assert_array_equal(episode.actions, rollout.actions)
        np.testing.assert_array_equal(episode.rewards, rollout.rewards)
    with pytest.raises(CampaignError, match="exists"):
        write_minari("bench/cart/random-v0", rollouts, Cart(), folder=tmp_path)
    with pytest.raises(ParameterError):
        write_minari("bench/cart/empty-v0", [], Cart(), folder=tmp_path)
