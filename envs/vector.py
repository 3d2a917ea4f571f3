"""The environments many at a time: one MuJoCo batch and one compiled ensemble for all of them."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from bench.errors import ParameterError, UnknownNameError
from bench.excitation.ensemble import available_threads

from .base import action_space, make_benches, observation_space, rest_info
from .options import require_count
from .rendering import RenderedPicture


class BenchVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """Benches side by side, with the numbers of `gymnasium.vector.SyncVectorEnv` over the single environments.

    Seeds, autoreset (`AutoresetMode.NEXT_STEP` by default, SAME_STEP and DISABLED on request), `info` arrays with their masks and
    `final_obs`/`final_info` follow gymnasium's own vector environments; observations, rewards and ends agree to the last bit.

    Attributes:
        benches: The benches behind it.
        num_envs: How many.
    """

    kind: ClassVar[str]

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        render_mode: str | None = None,
        **arguments: Any,
    ) -> None:
        """Set up benches.

        Args:
            num_envs: How many.
            autoreset_mode: What happens after the end of an episode.
            threads: Threads; all cores this process may use by default.
            render_mode: "rgb_array" for a picture of each, or None.
            **arguments: Those of the single environment.
        """
        require_count("num_envs", num_envs)
        if render_mode not in {None, "rgb_array"}:
            raise UnknownNameError("render mode of a vector environment", str(render_mode), ("rgb_array",))
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.render_mode = render_mode
        self.benches = self._make(num_envs, threads or available_threads(), arguments)
        fps = round(1.0 / (self.benches.n_steps * self.benches.timestep))
        self.metadata = {
            "autoreset_mode": self.autoreset_mode,
            "render_modes": ["rgb_array"],
            "render_fps": fps,
        }
        self.single_observation_space = observation_space(self.benches)
        self.single_action_space = action_space(self.benches)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rngs: list[np.random.Generator] = []
        self._all = np.arange(num_envs)
        self._ended = np.zeros(num_envs, dtype=bool)
        self._observation = np.zeros((num_envs, self.benches.n_observations), dtype=np.float32)
        self._picture: RenderedPicture | None = None

    def _make(self, n: int, threads: int, arguments: dict[str, Any]) -> Any:
        """The benches behind it."""
        return make_benches(self.kind, n, threads, arguments)

    @property
    def truth(self) -> tuple[Any, ...]:
        """The hidden rigs; for evaluation, not for policies."""
        return tuple(self.benches.truth)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Put new hidden rigs on the benches.

        Args:
            seed: A seed, counted up from bench to bench, or one for each; None goes on with the generators there are.
            options: ``{"reset_mask": array}`` with a bool for each bench resets only some.
        """
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        if seeds is not None and len(seeds) != self.num_envs:
            raise ParameterError(f"{len(seeds)} seeds came for {self.num_envs} environments")
        chosen = self._mask(options)
        if not self._rngs:
            self._rngs = [seeding.np_random(None)[0] for _ in range(self.num_envs)]
        for i in np.flatnonzero(chosen):
            if seeds is not None and seeds[i] is not None:
                self._rngs[i] = seeding.np_random(seeds[i])[0]
        places = np.flatnonzero(chosen)
        self._observation[places] = self.benches.reset(places, self._rngs)
        self._ended[places] = False
        return self._observation.copy(), self._infos({}, places, rest_info(self.benches, places))

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        if not options or "reset_mask" not in options:
            return np.ones(self.num_envs, dtype=bool)
        mask = np.asarray(options["reset_mask"])
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ParameterError(
                f"reset_mask has shape {mask.shape} and type {mask.dtype}; ({self.num_envs},) of bool, one of them true, is expected"
            )
        return mask

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[
        NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
    ]:
        """Run the next window on all benches; those whose episode ended are reset as the autoreset mode says.

        Args:
            actions: ``(num_envs, …)``.
        """
        actions = np.asarray(actions)
        if actions.shape != self.action_space.shape or not self._rngs:
            raise ParameterError(
                f"actions of shape {actions.shape} came; {self.action_space.shape} is expected, after a reset()"
            )
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            raise ParameterError(
                f"the episodes of environments {np.flatnonzero(self._ended).tolist()} have ended; reset them "
                "with options={'reset_mask': …}, or use another autoreset mode"
            )
        reward, ended = np.zeros(self.num_envs), self._ended
        terminated, truncated = np.zeros(self.num_envs, dtype=bool), np.zeros(self.num_envs, dtype=bool)
        infos: dict[str, Any] = {}
        fresh = np.flatnonzero(ended) if ended.any() else self._all[:0]
        if fresh.size:  # NEXT_STEP: the step after the last one is the reset
            self._observation[fresh] = self.benches.reset(fresh, self._rngs)
        running = np.flatnonzero(~ended) if fresh.size else self._all
        if running.size:
            outcome = self.benches.step(running, actions[running])
            self._observation[running] = outcome.observation
            reward[running] = outcome.reward
            terminated[running], truncated[running] = outcome.terminated, outcome.truncated
            self._infos(infos, running, outcome.info)
        if fresh.size:
            self._infos(infos, fresh, rest_info(self.benches, fresh))
        self._ended = terminated | truncated
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._ended.any():
            self._reset_at_once(infos)
        return self._observation.copy(), reward, terminated, truncated, infos

    def _reset_at_once(self, infos: dict[str, Any]) -> None:
        """Reset the benches whose episode has just ended, and keep its last observation and info."""
        places = np.flatnonzero(self._ended)
        final = np.full(self.num_envs, None, dtype=object)
        for place in places:
            final[place] = self._observation[place].copy()
        last = {name: values[places] for name, values in infos.items() if not name.startswith("_")}
        infos["final_obs"], infos["_final_obs"] = final, self._ended.copy()
        infos["final_info"], infos["_final_info"] = self._infos({}, places, last), self._ended.copy()
        self._observation[places] = self.benches.reset(places, self._rngs)
        self._infos(infos, places, rest_info(self.benches, places))
        self._ended = np.zeros(self.num_envs, dtype=bool)

    def _infos(
        self, infos: dict[str, Any], places: NDArray[np.int64], entries: dict[str, NDArray]
    ) -> dict[str, Any]:
        """Enter values of some benches into arrays over all, with gymnasium's masks."""
        every = len(places) == self.num_envs and not infos
        for name, values in entries.items():
            if every:
                infos[name], infos["_" + name] = values, np.ones(self.num_envs, dtype=bool)
                continue
            if name not in infos:
                infos[name] = np.zeros(self.num_envs, dtype=values.dtype)
                infos["_" + name] = np.zeros(self.num_envs, dtype=bool)
            infos[name][places] = values
            infos["_" + name][places] = True
        return infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """A picture of each bench ("rgb_array"), or None."""
        if self.render_mode is None:
            return None
        if self._picture is None:
            self._picture = RenderedPicture(self.benches.setup.rig)
        return tuple(self._picture.array(self.benches.positions(i)).copy() for i in range(self.num_envs))

    def close_extras(self, **_: Any) -> None:
        """Free what rendering took."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_picture": None}


class SDOFExcitationVectorEnv(BenchVectorEnv):
    """Vector environment of `envs.single.SDOFExcitationEnv`."""

    kind = "sdof"


class JointExcitationVectorEnv(BenchVectorEnv):
    """Vector environment of `envs.single.JointExcitationEnv`."""

    kind = "joint"


class DiscriminationVectorEnv(BenchVectorEnv):
    """Vector environment of `envs.single.DiscriminationEnv`."""

    kind = "discrimination"
