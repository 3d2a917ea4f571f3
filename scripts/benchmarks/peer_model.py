"""What the comparisons with `mujoco.sysid` share."""

from __future__ import annotations

import mujoco


class Compiled:
    """Stands in for an MjSpec where only its compiled model is wanted."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model

    def compile(self) -> mujoco.MjModel:
        """The compiled model."""
        return self.model
