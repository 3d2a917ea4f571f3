"""The reward that asks for coverage: growth of `bench.excitation.Coverage` of what the sensors measured of the joints' motion.

It needs no prior and no draws, and so serves where a joint of unknown kind is to be learnt as a polynomial, a network or a joint with
memory, rather than the parameters of a known law.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation import Coverage, CoverageSettings

from .places import StationSetup


@dataclass(frozen=True)
class CoverageRewardSettings:
    """Numbers of `envs.coverage`."""

    noises: float = 10.0
    """Least range of a stop in deviations of the displacement's noise: a fifth of it is then a cell, and neighbouring samples of a rig
    at rest, which differ by 1.4 deviations, seldom leave the middle one."""


SETTINGS = CoverageRewardSettings()


class CoverageReward:
    """Coverage of several benches, over the strokes and velocities within their limits."""

    def __init__(self, setup: StationSetup, n: int) -> None:
        """Open the books.

        Raises:
            ParameterError: A joint has no limit of stroke or none of velocity, so that nothing says what there is to cover.
        """
        stroke, velocity = setup.limits.stroke, setup.limits.velocity
        if not stroke or len(stroke) != len(velocity):
            raise ParameterError(
                f"strokes {list(stroke)} and velocities {list(velocity)} are limited; one of each a joint is expected for a reward of "
                "coverage"
            )
        channels = list(setup.noise)
        self._displacements = [channels.index(name) for name in stroke]
        self._velocities = [channels.index(name) for name in velocity]
        noise = max(setup.noise[name] / limit for name, limit in stroke.items())
        default = CoverageSettings()
        ranges = tuple(r for r in default.ranges if r >= SETTINGS.noises * noise)
        self.coverage = Coverage(
            tuple(stroke.values()), tuple(velocity.values()), n, replace(default, ranges=ranges)
        )

    def begin(self, places: NDArray[np.int64]) -> None:
        """Start anew on some benches."""
        self.coverage.begin(places)

    def gain(self, places: NDArray[np.int64], measured: NDArray[np.float64]) -> NDArray[np.float64]:
        """Growth of the merit ``(m,)`` [nat] by a window's measurements ``(m, n_steps, n_channels)``."""
        return self.coverage.take(
            places, measured[:, :, self._displacements], measured[:, :, self._velocities]
        )
