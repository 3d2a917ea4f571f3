"""Pictures of a bench: its full model, moved to the positions of the simulated one.

OpenGL is loaded when the first picture is asked for, and only then.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench.rig import Rig


@dataclass(frozen=True)
class RenderingSettings:
    """Numbers of `envs.rendering`."""

    width: int = 640
    height: int = 480


SETTINGS = RenderingSettings()
CAMERA = "overview"


class RenderedPicture:
    """Renderer of one bench.

    Attributes:
        rig: The rig with everything that is to be seen.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig.with_(elements=())
        self._data = mujoco.MjData(self.rig.scene)
        self._renderer: Any = None
        self._viewer: Any = None

    def _place(self, positions: NDArray[np.float64]) -> None:
        self._data.qpos[:] = positions
        mujoco.mj_forward(self.rig.scene, self._data)

    def array(self, positions: NDArray[np.float64]) -> NDArray[np.uint8]:
        """A picture ``(HEIGHT, WIDTH, 3)`` of the rig at joint positions ``(nq,)``."""
        if self._renderer is None:
            self._renderer = mujoco.Renderer(self.rig.scene, SETTINGS.height, SETTINGS.width)
        self._place(positions)
        own = mujoco.mj_name2id(self.rig.scene, mujoco.mjtObj.mjOBJ_CAMERA, CAMERA)
        # -1 is a free camera: a user's model has none of this name
        self._renderer.update_scene(self._data, camera=own)
        return self._renderer.render()

    def show(self, positions: NDArray[np.float64]) -> None:
        """Show the rig in MuJoCo's viewer; does nothing once its window has been closed."""
        if self._viewer is None:
            from mujoco import viewer  # noqa: PLC0415  (opens a connection to the display)

            self._viewer = viewer.launch_passive(
                self.rig.scene, self._data, show_left_ui=False, show_right_ui=False
            )
        if self._viewer.is_running():
            with self._viewer.lock():
                self._place(positions)
            self._viewer.sync()

    def close(self) -> None:
        """Free the renderer and close the window."""
        for item in (self._renderer, self._viewer):
            if item is not None:
                item.close()
        self._renderer = self._viewer = None
