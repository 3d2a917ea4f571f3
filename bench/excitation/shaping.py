"""How actions become commands: smooth knots, or a sine whose amplitude and frequency are steered."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError, UnknownNameError

SHAPINGS = ("knots", "amplitude_frequency")


def through_knots(knots: NDArray[np.float64], last: NDArray[np.float64], part: int) -> NDArray[np.float64]:
    """Commands ``(m, n_knots * part, n_actuators)`` that reach each knot along half a cosine.

    Args:
        knots: ``(m, n_knots, n_actuators)``.
        last: Where the commands are before the first ``(m, n_actuators)``.
        part: Steps from knot to knot.
    """
    before = np.concatenate([last[:, None], knots[:, :-1]], axis=1)
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, part + 1) / part)
    shaped = before[:, :, None] + rise[:, None] * (knots - before)[:, :, None]
    return shaped.reshape(len(knots), -1, knots.shape[2])


class Shaping:
    """Commands of a window from an action, continuous from window to window.

    ``knots``: each of `n_knots` numbers an actuator is the force, as a fraction of the largest, at the end of its part of the
    window; between knots the force follows half a cosine, so that its rate is zero at every knot.

    ``amplitude_frequency``: two numbers an actuator, the amplitude (−1 … 1 for 0 … the largest force) and the frequency (−1 … 1
    for the band, in octaves) at the end of the window; both move along straight lines, and the phase runs on.
    """

    def __init__(
        self, kind: str, n: int, *, n_actuators: int, band: tuple[float, float], n_knots: int = 1
    ) -> None:
        """Begin at rest.

        Args:
            kind: One of `SHAPINGS`.
            n: Number of laboratories.
            n_actuators: Number of actuators.
            band: Lowest and highest frequency [Hz].
            n_knots: Knots a window.
        """
        if kind not in SHAPINGS:
            raise UnknownNameError("shaping of actions", kind, SHAPINGS)
        if n_knots < 1:
            raise ParameterError(f"{n_knots} knots a window came; at least one is expected")
        self.kind = kind
        self.band = band
        self.n_knots = n_knots
        self.width = n_actuators * (n_knots if kind == "knots" else 2)
        self._last = np.zeros((n, n_actuators))  # force, or amplitude, as a fraction of the largest
        self._octave = np.zeros((n, n_actuators))  # place in the band, 0 … 1
        self._phase = np.zeros((n, n_actuators))

    def begin(self, places: NDArray[np.int64]) -> None:
        """Return to rest."""
        self._last[places] = 0.0
        self._octave[places] = 0.5
        self._phase[places] = 0.0

    def commands(
        self, places: NDArray[np.int64], actions: NDArray[np.float64], n_steps: int, timestep: float
    ) -> NDArray[np.float64]:
        """Commands ``(m, n_steps, n_actuators)`` as fractions of the largest force, for actions ``(m, width)`` in −1 … 1."""
        m = len(places)
        if self.kind == "knots":
            if n_steps % self.n_knots:
                raise ParameterError(
                    f"a window of {n_steps} steps does not divide into {self.n_knots} equal parts; choose another window or n_knots"
                )
            knots = actions.reshape(m, self.n_knots, -1)
            shaped = through_knots(knots, self._last[places], n_steps // self.n_knots)
            self._last[places] = knots[:, -1]
            return shaped
        pair = 0.5 + 0.5 * actions.reshape(m, -1, 2)
        along = np.arange(1, n_steps + 1)[:, None] / n_steps
        level = self._last[places][:, None] + along * (pair[..., 0] - self._last[places])[:, None]
        octave = self._octave[places][:, None] + along * (pair[..., 1] - self._octave[places])[:, None]
        frequency = self.band[0] * (self.band[1] / self.band[0]) ** octave
        phase = self._phase[places][:, None] + 2.0 * np.pi * timestep * np.cumsum(frequency, axis=1)
        self._last[places], self._octave[places] = pair[..., 0], pair[..., 1]
        self._phase[places] = phase[:, -1] % (2.0 * np.pi)
        return level * np.sin(phase)
