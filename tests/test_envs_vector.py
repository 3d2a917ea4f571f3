"""Vector environments: the numbers of gymnasium's own over the single environments, autoreset, threads, stable-baselines3."""

from __future__ import annotations

import pickle
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import envs
from bench.errors import BenchError, ParameterError

SDOF, JOINT, DISCRIMINATION = envs.IDS[:3]
VARIANTS: list[tuple[str, dict[str, Any]]] = [
    (SDOF, {"duration": 0.4}),
    (SDOF, {"duration": 0.3, "average": "posterior", "shaping": "amplitude_frequency"}),
    (SDOF, {"duration": 0.3, "reward": "error"}),
    (JOINT, {"duration": 0.14, "n_draws": 2}),
    (
        DISCRIMINATION,
        {"rig": "sdof", "pairs": ("gap_cubic", "coulomb_stribeck"), "n_draws": 2, "duration": 0.3},
    ),
]
MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP]


def name_of(variant: Any) -> str:
    return variant[11:16] if isinstance(variant, str) else getattr(variant, "name", "")


def vector(identifier: str, n: int = 5, **arguments: Any) -> gymnasium.vector.VectorEnv:
    return gymnasium.make_vec(identifier, num_envs=n, **arguments)


def same(a: Any, b: Any) -> None:
    """Two infos are equal, entry by entry and type by type."""
    assert set(a) == set(b)
    for name in a:
        if isinstance(a[name], dict):
            same(a[name], b[name])
        elif a[name].dtype == object:
            for x, y in zip(a[name], b[name], strict=True):
                np.testing.assert_array_equal(x, y)
        else:
            assert a[name].dtype == b[name].dtype
            np.testing.assert_array_equal(a[name], b[name])


@pytest.mark.parametrize("mode", MODES, ids=name_of)
@pytest.mark.parametrize(("identifier", "arguments"), VARIANTS, ids=name_of)
def test_numbers_are_those_of_the_single_environments(
    identifier: str, arguments: dict[str, Any], mode: AutoresetMode
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ours = vector(identifier, 9, autoreset_mode=mode, threads=2, **arguments)
        theirs = vector(
            identifier, 9, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **arguments
        )
    assert ours.metadata["autoreset_mode"] == mode
    assert (ours.single_observation_space, ours.action_space) == (
        theirs.single_observation_space,
        theirs.action_space,
    )
    ours.action_space.seed(0)
    first, second = ours.reset(seed=4), theirs.reset(seed=4)
    np.testing.assert_array_equal(first[0], second[0])
    same(first[1], second[1])
    ends = 0
    for _ in range(25):
        actions = ours.action_space.sample()
        a, b = ours.step(actions), theirs.step(actions)
        for x, y in zip(a[:4], b[:4], strict=True):
            assert x.dtype == y.dtype
            np.testing.assert_array_equal(x, y)
        same(a[4], b[4])
        ends += int((a[2] | a[3]).sum())
    assert ends >= 9  # every environment came to an end, and began anew


@pytest.mark.slow
def test_processes_give_the_same_numbers() -> None:
    arguments = {"duration": 0.3}
    ours, theirs = vector(SDOF, 2, **arguments), vector(SDOF, 2, vectorization_mode="async", **arguments)
    try:
        np.testing.assert_array_equal(ours.reset(seed=1)[0], theirs.reset(seed=1)[0])
        for _ in range(10):
            actions = np.full((2, 1), 0.7, dtype=np.float32)
            for x, y in zip(ours.step(actions)[:4], theirs.step(actions)[:4], strict=True):
                np.testing.assert_array_equal(x, y)
    finally:
        theirs.close()


def test_numbers_do_not_depend_on_threads_or_company() -> None:
    one, three, alone = (
        vector(JOINT, 12, threads=1),
        vector(JOINT, 12, threads=3),
        vector(JOINT, 1, threads=1),
    )
    seeds = list(range(100, 112))
    for environment in (one, three):
        environment.reset(seed=seeds)
    alone.reset(seed=[seeds[7]])
    rng = np.random.default_rng(0)
    for _ in range(12):
        actions = rng.uniform(-1.0, 1.0, (12, 2)).astype(np.float32)
        a, b, c = one.step(actions), three.step(actions), alone.step(actions[7:8])
        for x, y, z in zip(a[:4], b[:4], c[:4], strict=True):
            np.testing.assert_array_equal(x, y)
            np.testing.assert_array_equal(x[7:8], z)


def test_some_benches_can_be_reset_by_hand() -> None:
    benches = vector(SDOF, 3, autoreset_mode="Disabled", duration=0.08)
    benches.reset(seed=0)
    actions = np.zeros((3, 1), dtype=np.float32)
    benches.step(actions)
    observation, *_ = benches.step(actions)
    with pytest.raises(ParameterError, match="have ended"):
        benches.step(actions)
    mask = np.array([True, False, True])
    after, infos = benches.reset(seed=[7, None, None], options={"reset_mask": mask})
    np.testing.assert_array_equal(after[1], observation[1])
    np.testing.assert_array_equal(after[0], vector(SDOF, 1, duration=0.08).reset(seed=7)[0][0])
    np.testing.assert_array_equal(infos["_merit"], mask)
    with pytest.raises(ParameterError, match="reset_mask"):
        benches.reset(options={"reset_mask": np.zeros(3, dtype=bool)})


def test_a_vector_environment_survives_pickling_in_mid_episode() -> None:
    ours = vector(SDOF, 4)
    ours.reset(seed=2)
    rng = np.random.default_rng(0)
    for _ in range(5):
        ours.step(rng.uniform(-1.0, 1.0, (4, 1)).astype(np.float32))
    copy = pickle.loads(pickle.dumps(ours))
    for _ in range(5):
        actions = rng.uniform(-1.0, 1.0, (4, 1)).astype(np.float32)
        for x, y in zip(ours.step(actions)[:4], copy.step(actions)[:4], strict=True):
            np.testing.assert_array_equal(x, y)


def test_wrong_use_is_named() -> None:
    with pytest.raises(BenchError, match="at least one"):
        vector(SDOF, 0)
    with pytest.raises(BenchError, match="rgb_array"):
        vector(SDOF, 2, render_mode="human")
    ours = vector(SDOF, 2)
    with pytest.raises(BenchError, match="after a reset"):
        ours.step(np.zeros((2, 1), dtype=np.float32))
    with pytest.raises(BenchError, match="seeds came"):
        ours.reset(seed=[1])


@pytest.mark.slow
def test_stable_baselines_finds_nothing_to_complain_of() -> None:
    from stable_baselines3.common.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for identifier, arguments in [*VARIANTS, (SDOF, {}), (DISCRIMINATION, {})]:
            check_env(gymnasium.make(identifier, **arguments).unwrapped)


@pytest.mark.slow
def test_stable_baselines_trains_on_the_adapter() -> None:
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecMonitor

    from envs.sb3 import BenchVecEnv

    adapter = BenchVecEnv(SDOF, 3, duration=0.2)
    plain = vector(SDOF, 3, duration=0.2, autoreset_mode="SameStep")
    adapter.seed(5)
    np.testing.assert_array_equal(adapter.reset(), plain.reset(seed=5)[0])
    rng = np.random.default_rng(0)
    ends = 0
    for _ in range(11):
        actions = rng.uniform(-1.0, 1.0, (3, 1)).astype(np.float32)
        observation, reward, done, infos = adapter.step(actions)
        expected = plain.step(actions)
        np.testing.assert_array_equal(observation, expected[0])
        np.testing.assert_allclose(reward, expected[1], rtol=1e-6)  # single precision
        np.testing.assert_array_equal(done, expected[2] | expected[3])
        for place in np.flatnonzero(done):
            ends += 1
            np.testing.assert_array_equal(
                infos[place]["terminal_observation"], expected[4]["final_obs"][place]
            )
            assert infos[place]["TimeLimit.truncated"] == expected[3][place]
            assert infos[place]["time"] == pytest.approx(0.2)
    assert ends == 6
    assert len(adapter.get_attr("truth")) == 3
    model = PPO("MlpPolicy", VecMonitor(adapter), n_steps=10, batch_size=30, n_epochs=1, seed=0, device="cpu")
    model.learn(60)
    assert model.num_timesteps == 60
    adapter.close()
