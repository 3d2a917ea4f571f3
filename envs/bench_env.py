"""What the three environments of one bench share."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from bench.errors import UnknownNameError
from bench.excitation import Draw

from .base import RENDER_MODES, action_space, info_of, make_benches, observation_space, rest_info
from .rendering import RenderedPicture
from .stepped import SteppedBenches


class BenchEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One bench as a gymnasium environment; see the subclasses.

    Attributes:
        benches: The bench behind it.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 25}  # noqa: RUF012  (as gymnasium declares it)
    kind: ClassVar[str]

    def __init__(self, render_mode: str | None = None, **arguments: Any) -> None:
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise UnknownNameError("render mode", render_mode, RENDER_MODES)
        self.render_mode = render_mode
        self.benches: Any = self._make(arguments)
        self.metadata = {
            **type(self).metadata,
            "render_fps": round(1.0 / (self.benches.n_steps * self.benches.timestep)),
        }
        self.observation_space = observation_space(self.benches)  # pyrefly: ignore[bad-assignment]
        self.action_space = action_space(self.benches)  # pyrefly: ignore[bad-assignment]
        self._picture: RenderedPicture | None = None

    def _make(self, arguments: dict[str, Any]) -> SteppedBenches:
        """The bench behind it."""
        return make_benches(self.kind, 1, 1, arguments)

    @property
    def truth(self) -> Draw | None:
        """The hidden rig of this episode; for evaluation, not for policies."""
        return self.benches.truth[0]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Put a new hidden rig, at rest, on the bench.

        Args:
            seed: Seed of this and the following episodes' rigs and noise.
            options: None are known.
        """
        super().reset(seed=seed)
        observation = self.benches.reset(np.zeros(1, dtype=np.int64), [self.np_random])[0]
        if self.render_mode == "human":
            self.render()
        return observation, info_of(rest_info(self.benches, np.zeros(1, dtype=np.int64)), 0)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Run the next window.

        Args:
            action: Numbers in −1 … 1, see `action_space`.

        Raises:
            ResetNeeded: Called before `reset`.
        """
        if self.truth is None:
            raise ResetNeeded("call reset() before step(): there is no rig on the bench yet")
        outcome = self.benches.step(np.zeros(1, dtype=np.int64), np.asarray(action)[None])
        if self.render_mode == "human":
            self.render()
        return (
            outcome.observation[0],
            float(outcome.reward[0]),
            bool(outcome.terminated[0]),
            bool(outcome.truncated[0]),
            info_of(outcome.info, 0),
        )

    def render(self) -> Any:
        """A picture ``(480, 640, 3)`` of uint8 ("rgb_array"), or None after moving the window's rig ("human")."""
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() was called without a render mode; pass render_mode='rgb_array' or 'human' to make()"
            )
            return None
        if self._picture is None:
            self._picture = RenderedPicture(self.benches.setup.rig)
        positions = self.benches.positions(0)
        if self.render_mode == "human":
            self._picture.show(positions)
            return None
        return self._picture.array(positions)

    def close(self) -> None:
        """Free what rendering took."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_picture": None}
