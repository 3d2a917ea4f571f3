"""Rollouts of a policy in a gymnasium environment, and their export as a Minari data set for offline learning."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.campaign.lock import CampaignError
from bench.errors import ParameterError
from bench.files import folder_made_in

MINARI_ROOT = "MINARI_DATASETS_PATH"
"""Environment variable by which Minari finds its data sets."""

Actor = Callable[[Any, np.random.Generator], Any]
"""An action from an observation and a source of randomness."""


class Rollout(NamedTuple):
    """One episode of n steps.

    Attributes:
        seed: Seed the environment was reset with.
        observations: ``(n + 1, …)``, the one after the last step included.
        actions: ``(n, …)``.
        rewards: ``(n,)``.
        terminations: ``(n,)``.
        truncations: ``(n,)``.
    """

    seed: int
    observations: NDArray
    actions: NDArray
    rewards: NDArray[np.float64]
    terminations: NDArray[np.bool_]
    truncations: NDArray[np.bool_]


def collect(
    env: Any, policy: Actor, *, episodes: int, seed: int = 0, max_steps: int = 100_000
) -> list[Rollout]:
    """Run a policy for some episodes.

    Args:
        env: A gymnasium environment with array observations and actions.
        policy: Gives an action from an observation and a generator.
        episodes: Number of episodes; episode k is reset with a seed drawn from (seed, k), and acts with a generator of its own.
        seed: Seed of all of it.
        max_steps: Steps after which an episode counts as truncated.

    Returns:
        One rollout an episode.

    Raises:
        ParameterError: No episodes.
    """
    if episodes < 1 or max_steps < 1:
        raise ParameterError(
            f"{episodes} episodes of at most {max_steps} steps came; at least one of each is expected"
        )
    return [
        _episode(env, policy, np.random.SeedSequence(seed, spawn_key=(k,)), max_steps)
        for k in range(episodes)
    ]


def _episode(env: Any, policy: Actor, sequence: np.random.SeedSequence, max_steps: int) -> Rollout:
    reset = int(sequence.generate_state(1)[0]) >> 1  # gymnasium takes a C long, 32 bits on some systems
    rng = np.random.default_rng(sequence)
    observation, _ = env.reset(seed=reset)
    observations, actions, rewards, ends = [np.array(observation)], [], [], []
    while not ends or not any(ends[-1]):
        action = policy(observation, rng)
        observation, reward, terminated, truncated, _ = env.step(action)
        observations.append(np.array(observation))
        actions.append(np.array(action))
        rewards.append(float(reward))
        ends.append((bool(terminated), bool(truncated) or (len(actions) >= max_steps and not terminated)))
    terminations, truncations = np.array(ends).T
    return Rollout(
        reset, np.stack(observations), np.stack(actions), np.array(rewards), terminations, truncations
    )


def write_minari(
    dataset: str,
    rollouts: Sequence[Rollout],
    env: Any,
    *,
    folder: str | Path | None = None,
    algorithm: str = "",
    author: str = "",
    description: str = "",
) -> Path:
    """Store rollouts as a Minari data set.

    Args:
        dataset: Its name, as "jointbench/shaker/random-v0".
        rollouts: The episodes.
        env: The environment they come from, for its spaces and specification.
        folder: Root of the data sets; Minari's own (``~/.minari/datasets``) where None.
        algorithm: What the policy is.
        author: Who made it.
        description: For whoever finds it.

    Returns:
        Folder of the data set, which `minari.load_dataset(dataset)` reads.

    Raises:
        CampaignError: Minari is not installed, or a data set of that name exists.
        ParameterError: No rollouts.
    """
    try:
        import minari  # noqa: PLC0415
        from minari.data_collector import EpisodeBuffer  # noqa: PLC0415
    except ImportError as error:
        raise CampaignError("the export of rollouts needs Minari: pip install 'minari[hdf5]'") from error
    if not rollouts:
        raise ParameterError("no rollouts came; collect at least one episode")
    buffers = [
        EpisodeBuffer(
            id=index,
            seed=episode.seed,
            observations=list(episode.observations),
            actions=list(episode.actions),
            rewards=episode.rewards.tolist(),
            terminations=episode.terminations.tolist(),
            truncations=episode.truncations.tolist(),
        )
        for index, episode in enumerate(rollouts)
    ]
    root = Path(folder or os.environ.get(MINARI_ROOT) or Path.home() / ".minari" / "datasets").resolve()
    if os.path.lexists(root / dataset):
        raise CampaignError(f"the data set '{dataset}' exists in {root}; give it another version, as -v1")
    with folder_made_in(root, dataset) as stage, _minari_root(stage), warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", UserWarning
        )  # one for each field of the description that is not given
        try:
            minari.create_dataset_from_buffers(
                dataset,
                buffers,
                env=env.unwrapped.spec,
                observation_space=env.observation_space,
                action_space=env.action_space,
                algorithm_name=algorithm or None,
                author=author or None,
                description=description or None,
                data_format="hdf5",
                jpeg_encoding=False,
            )
        except ValueError as error:
            raise ParameterError(f"Minari does not take the data set '{dataset}': {error}") from error
    return root / dataset


@contextmanager
def _minari_root(folder: Path) -> Iterator[None]:
    """Make a folder the root of Minari's data sets, which it finds by an environment variable only; put back afterwards."""
    before = os.environ.get(MINARI_ROOT)
    os.environ[MINARI_ROOT] = str(folder)
    try:
        yield
    finally:
        os.environ.pop(MINARI_ROOT)
        if before is not None:
            os.environ[MINARI_ROOT] = before
