"""The vector environments for stable-baselines3; importing this module imports that library (extra `rl`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from bench.errors import UnknownNameError

from . import IDS
from .practice_vector import PracticeVectorEnv
from .vector import BenchVectorEnv

KINDS: dict[str, str] = dict(zip(IDS[:3], PracticeVectorEnv.KINDS, strict=True))
"""Kinds of practice bench; `JointBench/ModelExcitation-v0` has none, since its reward is taken at the hidden arm already."""


class BenchVecEnv(VecEnv):
    """A vector environment of the bench as stable-baselines3 wants it.

    Example:
        >>> from envs.sb3 import BenchVecEnv  # doctest: +SKIP
        >>> model = PPO("MlpPolicy", BenchVecEnv("JointBench/SDOFExcitation-v0", 64))  # doctest: +SKIP

    Attributes:
        benches: The vector environment behind it, in autoreset mode SAME_STEP.
    """

    def __init__(self, id: str, num_envs: int, *, practice: bool = False, **arguments: Any) -> None:
        """Make a vector environment.

        Args:
            id: Id of a registered environment.
            num_envs: How many.
            practice: Practice benches in its place, see `envs.practice`.
            **arguments: Arguments of the environment.

        Raises:
            UnknownNameError: The environment has no practice benches.
        """
        mode = AutoresetMode.SAME_STEP
        if practice and id not in KINDS:
            raise UnknownNameError("environment with practice benches", id, KINDS)
        vector: Any = (
            PracticeVectorEnv(KINDS[id], num_envs, autoreset_mode=mode, **arguments)
            if practice
            else gymnasium.make_vec(
                id,
                num_envs=num_envs,
                vectorization_mode="vector_entry_point",
                autoreset_mode=mode,
                **arguments,
            )
        )
        self.benches: BenchVectorEnv = vector
        self._actions: NDArray[np.float32] | None = None
        self.render_mode = vector.render_mode  # asked for by the base class
        super().__init__(num_envs, vector.single_observation_space, vector.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Reset all; seeds come from `seed`."""
        seeds = self._seeds if any(seed is not None for seed in self._seeds) else None
        observation, infos = self.benches.reset(seed=seeds)
        self.reset_infos = self._dictionaries(infos)
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Run the step."""
        assert self._actions is not None, "step_async comes before step_wait"
        observation, reward, terminated, truncated, infos = self.benches.step(self._actions)
        done = terminated | truncated
        dictionaries = self._dictionaries(infos)
        for place in np.flatnonzero(done):
            last = infos["final_info"]
            self.reset_infos[place] = dictionaries[place]
            dictionaries[place] = {
                name: last[name][place].item() for name in last if not name.startswith("_")
            }
            dictionaries[place]["terminal_observation"] = infos["final_obs"][place]
            dictionaries[place]["TimeLimit.truncated"] = bool(truncated[place])
        return observation, reward.astype(np.float32), done, dictionaries  # type: ignore[return-value]

    @staticmethod
    def _dictionaries(infos: dict[str, Any]) -> list[dict[str, Any]]:
        names = [name for name in infos if not name.startswith(("_", "final"))]
        columns = [infos[name].tolist() for name in names]
        return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]

    def close(self) -> None:
        """Free what rendering took."""
        self.benches.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """A picture of each environment, or none where they do not render."""
        return self.benches.render() or [None] * self.num_envs

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the environments; they share all but `truth`."""
        value = getattr(self.benches, attr_name)
        shared = attr_name != "truth"
        return [value if shared else value[i] for i in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Not possible: the environments are set up by their arguments.

        Raises:
            AttributeError: Always.
        """
        raise AttributeError(f"'{attr_name}' cannot be set; pass arguments when the environments are made")

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of the vector environment once; each of `indices` gets the result."""
        result = getattr(self.benches, method_name)(*method_args, **method_kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """No environment of a batch is wrapped."""
        return [False for _ in self._get_indices(indices)]
