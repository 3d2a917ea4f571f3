"""The statistical problem of a case: residuals in units of their noise, and priors, about what a simulator predicts.

Residuals are compared in the frequency domain, up to the frequency where the response sinks into its noise, and are
whitened there: besides the noise of the response channels, the noise of a measured load drives the free run
and leaves residuals at the resonance, correlated between channels, which a plain weighting would take for an effect.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord, beginning
from bench.discrepancy.likelihood.model_error import ModelInadequacy
from bench.discrepancy.likelihood.noise_covariance import sensor_gains, whitening_behind
from bench.discrepancy.likelihood.time_varying_noise import whitening_together
from bench.discrepancy.likelihood.whitening import (
    RecordData,
    band_bins,
    projected,
    reached,
    timed,
    without_bridged,
)
from bench.discrepancy.likelihood.window_whitening import RestartWindows, white_force, window_weights
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.motion.observer import ACCELERATION
from bench.discrepancy.motion.prescribed import decided
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.response.windows import cut
from bench.discrepancy.simulation.stick_slip import Motion


@dataclass
class Problem(Simulator):
    """A simulator whose predictions are held against records: the noise of the residuals, and the priors of all parameters.

    What takes no residual and no prior of it is content with a `Simulator`.

    Attributes:
        bins: Frequency bins of every record, where they have to agree with those of another problem.
        error: Error of the model that residuals are weighed by besides their noise; None where noise is all that they hold.
        within: Stated standard deviations that a nominal parameter may move.
        deadline: When fits end where they are.
        data: Records, prepared.
        passed: Effects and vector of the model that the noise of what drives it passes into the residuals.
    """

    bins: Mapping[str, int] | None = None
    error: ModelInadequacy | None = None
    within: float = np.inf
    deadline: Deadline = NEVER
    data: tuple[RecordData, ...] = field(init=False)
    passed: tuple[Hypothesis, Array] = field(init=False)
    _weights: dict[tuple[float, int, float, bytes], tuple[Array, Array, Array]] = field(
        init=False, repr=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        self.passed = ((), np.zeros(len(self.nominal)))
        self.data = tuple(self.prepare(record) for record in self.records)

    def prepare(self, record: CaseRecord, passed: tuple[Hypothesis, Array] | None = None) -> RecordData:
        """Prepare a record for comparison.

        Args:
            record: The record.
            passed: Effects and vector of the model that noise passes on its way into the residuals; `passed` where None.
        """
        passed = passed or self.passed
        loads, responses = self.loads_of(record), self.responses_of(record)
        n_bins = (
            self.bins[record.name]
            if self.bins and record.name in self.bins
            else band_bins(responses, self.noise, settings=self.settings.likelihood)
        )
        windows = self._weighed_windows(self._windows_of(record, n_bins, self.split(*passed)[0]))
        compared = without_bridged(
            decided(self.prescribed(record), settings=self.settings.motion) if self.driven else None, record
        )
        whitening = self._weighed(whitening_behind(self, record, n_bins, passed, compared), record)
        together = None
        if self.structure.springs and not self.windowed and self.error is None:
            gains = sensor_gains(self, record, passed)
            together = whitening_together(self, record, n_bins, self.split(*passed)[0], gains)
        return RecordData(record, loads, responses, n_bins, whitening, windows, compared, together)

    def _weighed(self, whitening: NDArray[np.complex128], record: CaseRecord) -> NDArray[np.complex128]:
        """A whitening by noise (n_bins, n_channels, n_channels), by the error of the model besides."""
        if self.error is None:
            return whitening
        n_bins, n_channels = whitening.shape[:2]
        factor = np.linalg.inv(whitening)
        beyond = self.error.of(record.name, self.structure.channels, n_bins)
        covariance = factor @ np.conj(np.swapaxes(factor, 1, 2)) + np.eye(n_channels) * beyond[:, None, :]
        weights = self.error.weights(n_bins)
        white = np.linalg.inv(np.linalg.cholesky(covariance)) * np.sqrt(weights)[:, None, None]
        return np.asarray(white, dtype=np.complex128)

    def _windows_of(self, record: CaseRecord, n_bins: int, values: Array) -> RestartWindows | None:
        """Windows of a record that would drift, whitened for the structure at parameter `values`; None for other records."""
        if not self.windowed:
            return None
        settings = self.settings.likelihood
        firsts, length = cut(self.case, record, len(self.noise), settings=settings)
        share = round(2.0 * n_bins / len(record), 2)
        key = (record.step, length, share, values.tobytes())
        if key not in self._weights:
            self._weights[key] = window_weights(
                self.structure,
                self.structure.at(values),
                step=record.step,
                length=length,
                share=share,
                noise=self.noise,
                load_noise=self.load_noise,
                model_error=white_force(self),
                settings=settings,
            )
        return RestartWindows(firsts, length, *self._weights[key])

    def _weighed_windows(self, windows: RestartWindows | None) -> RestartWindows | None:
        """Windows, weighed by the error of the model besides."""
        if windows is None or self.error is None:
            return windows
        factor = np.sqrt(self._window_weight(windows) / self.error.scale)
        return windows._replace(weights=windows.weights * factor)

    def _window_weight(self, windows: RestartWindows) -> float:
        """How much each residual of windows counts."""
        return 1.0 if self.error is None else self.error.window_weight(windows.n_residuals)

    def behind(self, hypothesis: Hypothesis, vector: Array) -> Problem:
        """The same records, their noise as an explanation passes it on."""
        out = copy.copy(self)
        out.passed = (hypothesis, vector)
        out.data = tuple(out.prepare(record) for record in self.records)
        return out

    def bounded(self, within: float) -> Problem:
        """A copy whose nominal parameters move by so many stated standard deviations at most."""
        out = copy.copy(self)
        out.within = within
        return out

    def beginnings(self, samples: Sequence[int]) -> Problem:
        """A copy of the first samples of every record, by their noise alone; the scales of the effects stay, and so do vectors.

        Args:
            samples: Number of samples of each record.
        """
        out = copy.copy(self)
        short = [
            replace(beginning(r, n), name=f"{r.name}, {n} samples")
            for r, n in zip(self.records, samples, strict=True)
        ]
        kept = [
            Motion(*(part[:n] for part in self.motion_of(r)))
            for r, n in zip(self.records, samples, strict=True)
        ]
        out.records, out.error = tuple(short), None
        out.motions = self.motions | {record.name: motion for record, motion in zip(short, kept, strict=True)}
        out.data = tuple(out.prepare(record) for record in short)
        return out

    def beside(self, records: Sequence[CaseRecord]) -> Problem:
        """A copy of all records and further ones that start at rest; the scales of the effects stay, and so do vectors."""
        out = copy.copy(self)
        out.records = (*self.records, *records)
        out.data = (*self.data, *(self.prepare(record) for record in records))
        return out

    def residual(self, hypothesis: Hypothesis, vector: Array) -> Array:
        """Whitened residuals of all records, real and imaginary parts stacked; their sum of squares is chi-squared."""
        return self._residual(hypothesis, vector, [None] * len(self.data))

    def residual_near(self, hypothesis: Hypothesis, vector: Array) -> Callable[..., Array]:
        """`residual` as a function of vectors near one, for differences by them, and of effects of channels beside the hypothesis.

        What other starts of windows would change is that at the one vector. It moves with the vector, too, and with it the residuals by
        the product of that and of how wrong the starts are, which noise alone makes them; L. Kaufman, A variable projection method for
        solving separable nonlinear least squares problems, BIT 15 (1975) 49-57. So a column of differences takes one free run, not one
        more for each entry of a start; and none where sensors alone differ, which read the same motion.
        """
        bases: list[Sequence[Array] | None] = (
            in_threads(lambda data: self._reached(data, hypothesis, vector), self.data)
            if self.windowed
            else [None] * len(self.data)
        )
        acting = self._acting(hypothesis)
        motions: dict[str, Motion] = {}

        def motion_of(data: RecordData) -> Motion:
            """Motion at the one vector; of threads that ask at once each makes it, the same."""
            if data.record.name not in motions:
                motions[data.record.name] = self.free_motion(hypothesis, vector, data.record)
            return motions[data.record.name]

        def near(moved: Array, *beside: Placed) -> Array:
            sensors = all(placed.effect.site == "sensor" for placed in beside)
            known = (
                not self.driven and sensors and np.array_equal(moved[: len(vector)][acting], vector[acting])
            )
            return self._residual((*hypothesis, *beside), moved, bases, motion_of if known else None)

        return near

    def _acting(self, hypothesis: Hypothesis) -> NDArray[np.bool_]:
        """Entries of a vector that the motion depends on: all but those of sensors."""
        effects = [
            np.full(len(placed.effect.parameters), placed.effect.site != "sensor") for placed in hypothesis
        ]
        return np.concatenate([np.ones(len(self.nominal), dtype=bool), *effects])

    def _residual(
        self,
        hypothesis: Hypothesis,
        vector: Array,
        bases: Sequence[Sequence[Array] | None],
        motion_of: Callable[[RecordData], Motion] | None = None,
    ) -> Array:
        parts = in_threads(
            lambda task: self.residual_of(
                task[0],
                hypothesis,
                vector,
                bases=task[1],
                motion=None if motion_of is None else motion_of(task[0]),
            ),
            list(zip(self.data, bases, strict=True)),
        )
        finite = [part for part in parts if part is not None]
        return np.concatenate(finite) if len(finite) == len(parts) else np.array([np.inf])

    def _reached(
        self, data: RecordData, hypothesis: Hypothesis, vector: Array, predicted: Array | None = None
    ) -> Sequence[Array] | None:
        """What other starts of the windows would change, see `reached`; nothing for other records, None where a run diverged."""
        if not self.windowed:
            return ()
        predicted = self.simulate(hypothesis, vector, data.record) if predicted is None else predicted
        moved = self.start_responses(hypothesis, vector, data.record, predicted)
        finite = all(np.isfinite(change).all() for change in moved)
        return reached(moved, data, settings=self.settings.likelihood) if finite else None

    def residual_of(
        self,
        data: RecordData,
        hypothesis: Hypothesis,
        vector: Array,
        *,
        lenient: bool = True,
        bases: Sequence[Array] | None = None,
        motion: Motion | None = None,
    ) -> Array | None:
        """Whitened residuals of one record, jumps that come a little early or late excused if `lenient`; None where it diverged.

        What other starts of windows would change is `bases`, and the motion of the free run `motion`, where these are given.
        """
        predicted = self.simulate(hypothesis, vector, data.record, motion=motion)
        if not np.isfinite(predicted).all():
            return None
        bases = self._reached(data, hypothesis, vector, predicted) if bases is None else bases
        if bases is None:
            return None
        residual = data.responses - predicted
        excused = lenient and hypothesis and not self.driven
        for c, observer in enumerate(self.structure.observers if excused else ()):
            if observer.order == ACCELERATION:
                residual[:, c] = timed(
                    residual[:, c], predicted[:, c], self.noise[c], settings=self.settings.likelihood
                )
        return projected(residual, bases, data)

    @property
    def scaled(self) -> bool:
        """Whether chi-squared has an absolute meaning: by the stated noise, or by the error of the model."""
        return self.noise_stated or self.error is not None

    @property
    def n_residuals(self) -> float:
        """Number of real residuals, that is degrees of freedom of chi-squared before the fit; of weighed ones their weights."""
        return sum(self._count(d) for d in self.data)

    def _count(self, data: RecordData) -> float:
        """Number of residuals of a record, each by the weight that it has."""
        if data.windows is not None:
            return data.windows.n_residuals * self._window_weight(data.windows)
        if self.error is None:
            return 2 * data.n_bins * len(self.noise)
        return 2.0 * len(self.noise) * float(np.sum(self.error.weights(data.n_bins)))

    def prior(self, hypothesis: Hypothesis) -> tuple[Array, Array, Array, Array]:
        """Mean, standard deviation, lower and upper bound of the vector of a hypothesis."""
        n = len(self.nominal)
        mean, std = [np.zeros(n)], [np.ones(n)]
        low, high = [np.full(n, -np.inf)], [np.full(n, np.inf)]
        positive = (self.nominal > 0) & (self.spread > 0) & (np.arange(n) < self.n_physical)
        low[0][positive] = -0.98 * self.nominal[positive] / self.spread[positive]
        physical = np.arange(n) < self.n_physical
        low[0][physical] = np.maximum(low[0][physical], -self.within)
        high[0][physical] = self.within
        for placed in hypothesis:
            p = placed.effect.parameters
            mean.append(np.array([x.mean for x in p]))
            std.append(np.array([x.std for x in p]))
            low.append(np.array([x.bounds[0] for x in p]))
            high.append(np.array([x.bounds[1] for x in p]))
        return np.concatenate(mean), np.concatenate(std), np.concatenate(low), np.concatenate(high)
