"""A vector environment whose actions are corrections of a schedule."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper, VecNormalize

from bench.excitation.station import Station

from .sb3 import BenchVecEnv


class Scheduled(VecEnvWrapper):
    """Adds a schedule to actions, as `bench.excitation.Policy` does.

    Attributes:
        station: Where the benches stand.
        schedule: Actions ``(n_questions, n_windows, width)``.
    """

    def __init__(self, venv: BenchVecEnv, schedule: NDArray[np.float32]) -> None:
        super().__init__(venv)
        self.station: Station = venv.benches.benches.station
        self.schedule = schedule
        self._last = np.zeros((venv.num_envs, venv.benches.benches.n_observations), dtype=np.float32)

    def reset(self) -> NDArray[np.float32]:
        """Reset all."""
        self._last = np.asarray(self.venv.reset())
        return self._last

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take corrections of the schedule."""
        self.venv.step_async(np.clip(actions + self.station.scheduled(self._last, self.schedule), -1.0, 1.0))

    def step_wait(self) -> Any:
        """Run the step; the end of a test is an end, with nothing to come, since the window is observed and the duration known."""
        observation, reward, done, infos = self.venv.step_wait()
        self._last = np.asarray(observation)
        for place in np.flatnonzero(done):
            infos[place]["TimeLimit.truncated"] = False
        return observation, reward, done, infos


def scheduled(env: VecNormalize) -> Scheduled:
    """The environment behind statistics of its observations."""
    """The environment behind statistics of its observations."""
    assert isinstance(env.venv, Scheduled)
    return env.venv
