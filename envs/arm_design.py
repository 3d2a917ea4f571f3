"""Joint targets for a user's own model, made before the test: the multisine that tells most of those that every drawn arm can follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.signals import Multisine

from .arms import ArmSetup
from .model import ModelBenches
from .options import Options


@dataclass(frozen=True)
class ArmDesignSettings:
    """Numbers of `envs.arm_design`."""

    candidates: int = 16
    draws: int = 6
    """Arms drawn from what is unknown, on each of which the limits are kept and the merit is told."""
    tries: int = 6
    margin: float = 0.97
    """Of the limits that a scaled candidate aims at: the response is nearly proportional, not quite."""


SETTINGS = ArmDesignSettings()


class ArmDesign(NamedTuple):
    """Targets and what they are expected to tell.

    Attributes:
        benches: The drawn arms after the test; `write_targets` writes it.
        error: Expected error, root mean square over the unknown parameters, mean of its logarithm over the drawn arms [prior standard
            deviations].
        reached: Largest range, and largest velocity or torque, as fractions of the limits.
    """

    benches: ModelBenches
    error: float
    reached: tuple[float, float]

    def write(self, path: Path) -> None:
        """Write the targets as CSV, see `ModelBenches.write_targets`."""
        self.benches.write_targets(path)


def design_targets(
    setup: ArmSetup,
    *,
    seed: int = 0,
    settings: ArmDesignSettings = SETTINGS,
    tell: Callable[[int, float], None] = lambda candidate, error: None,
) -> ArmDesign:
    """Design targets for a test from rest.

    Args:
        setup: The model and what may be asked of it.
        seed: Seed of the drawn arms, their noise and the candidates.
        settings: Numbers of the search.
        tell: Called with each candidate's number and expected error.

    Raises:
        ParameterError: No candidate keeps the limits, however small.
    """
    rng = np.random.default_rng(seed)
    benches = ModelBenches(setup, Options(enforcement="cost", penalty=0.0), settings.draws)
    best: tuple[float, NDArray[np.float64]] | None = None
    for candidate in range(settings.candidates):
        actions = _multisine(benches, rng)
        scaled = _within(benches, actions, seed, settings)
        if scaled is None:
            continue
        error = float(np.exp(-benches.merit.mean()))
        tell(candidate, error)
        if best is None or error < best[0]:
            best = error, scaled
    if best is None:
        raise ParameterError(
            f"no motion of '{setup.asked.model}' keeps its ranges, velocities and torques, however small; gravity alone may pass "
            "them: widen the limits, or narrow `ranges` to where the drives can hold the arm"
        )
    reached = _run(benches, best[1], seed)
    return ArmDesign(benches, best[0], (float(reached[:, 0].max()), float(reached[:, 1].max())))


def _multisine(benches: ModelBenches, rng: np.random.Generator) -> NDArray[np.float64]:
    """Actions of a test ``(n_windows, n_axes)``, within −1 … 1."""
    window = benches.n_steps * benches.timestep
    low, high = benches.station.band
    signal = Multisine(
        band=(low, min(high, 0.4 / window)), phases="random"
    )  # below half the rate of the knots
    columns = [signal.sample(benches.n_windows, 1.0 / window, rng) for _ in benches.setup.axes]
    actions = np.stack(columns, axis=1)
    return actions / np.max(np.abs(actions), axis=0)


def _within(
    benches: ModelBenches, actions: NDArray[np.float64], seed: int, settings: ArmDesignSettings
) -> NDArray[np.float64] | None:
    """The actions, made smaller until every drawn arm keeps its limits; None where that does not come about."""
    for _ in range(settings.tries):
        over = float(_run(benches, actions, seed).max())
        if over <= 1.0:
            return actions
        actions = actions * (settings.margin / over)
    return None


def _run(benches: ModelBenches, actions: NDArray[np.float64], seed: int) -> NDArray[np.float64]:
    """Run a test on all drawn arms, always the same; what each reaches of its limits ``(n, 2)``."""
    places = np.arange(benches.n)
    benches.reset(places, [np.random.default_rng([seed, place]) for place in range(benches.n)])
    for action in actions:
        benches.step(places, np.broadcast_to(action, (benches.n, len(action))))
    return benches.desk.peak
