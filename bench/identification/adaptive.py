"""Adaptive least squares with forgetting: one sample at a time, or a whole record by the same compiled step.

``estimator = AdaptiveLeastSquares(bouc_wen_model(2)); estimator.update(sample)`` keeps constant memory and does bounded work a
sample: O(n^2), and O(n^3) twice a window for the persistence monitor. `run` gives the same numbers at the speed of
the compiled loop. The law and its discretisation are in `bench.identification.stream_law`, the models in
`bench.identification.regressors`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import IdentificationError, ParameterError, RecordingError
from bench.identification import layout, stream
from bench.identification.adaptive_history import AdaptiveHistory, Sample
from bench.identification.adaptive_state import initial_state
from bench.identification.event_log import SETTINGS, EventLog
from bench.identification.persistence import PersistenceHistory, PersistenceReport
from bench.identification.regressors import CHANNELS, RegressorModel
from bench.identification.stream_law import reset_covariance

_TROUBLE = ~(layout.REPORTED | layout.EXCITATION_BACK | layout.MOVING)


class AdaptiveLeastSquares:
    """Continuous-time least squares with forgetting and normalisation on a stream of samples.

    Args:
        model: What to fit, from `bench.identification.regressors`.
        sample_rate: Nominal rate [Hz]; taken from the first two samples where None (give it if stamps jitter).
        forgetting: beta [1/s]; the estimates remember the last 1/beta seconds. 0 remembers all.
        initial_covariance: P0 of the scaled parameters, times the identity. Data weigh in by their time integral, so 1000
            (the dissertation's) means that an integral of phi^2 of 1e-3 s counts as much as the start value.
        bound: R0, bound of trace(P) (and so of its norm); 10 times the start where None.
        theta0: Start values (n,), physical; zeros where None.
        normalise: Whether m_s^2 is 1 + phi^T phi, or 1.
        window: Length of the monitor's window [s]; at least a period of the slowest motion.
        level_floor: A column is unexcited below this fraction of its highest level so far.
        min_eigenvalue: Smallest trusted eigenvalue of the regressor's correlation matrix. 1e-8 is what double precision
            and clean signals bear; noise e (relative to z) makes estimates unreliable below about e^2 / number of
            samples in the window.
        max_pull: Largest part of a parameter by which the start may still pull its estimate, for it to be trusted: what the
            estimate would move by, were the start's own information left out (see `stream_monitor.judge_prior`). The
            pull is exact where data hold no noise, so that this is what a trusted estimate may be off by on account of its start,
            and not a statistical threshold.
        jump_ratio: Reset the covariance when the mean square of the recent normalised innovation exceeds its long
            average this many times; 0 for never. Tracks a sudden change without the noise that forgetting lets in.
        jump_time: Averaging time of the recent innovation [s].
        stuck_after: Equal consecutive values after which a channel counts as constant and the estimate is held.
        gap: A step longer than this many nominal steps counts as dropped samples.

    Attributes:
        model: The model.
        events: The last events, `EventLogSettings.most` of them.

    Raises:
        ParameterError: A setting lies outside its range.

    References:
        Ioannou and Sun 1996, Robust Adaptive Control, sections 4.3.6-4.3.7; Tasbihgoo 2006, eqs 2.7-2.9, 3.14-3.15.
    """

    def __init__(
        self,
        model: RegressorModel,
        *,
        sample_rate: float | None = None,
        forgetting: float = 0.0,
        initial_covariance: float = 1e3,
        bound: float | None = None,
        theta0: ArrayLike | None = None,
        normalise: bool = True,
        window: float = 5.0,
        level_floor: float = 0.01,
        min_eigenvalue: float = 1e-8,
        max_pull: float = 0.05,
        jump_ratio: float = 0.0,
        jump_time: float = 0.2,
        stuck_after: int = 100,
        gap: float = 1.5,
    ) -> None:
        self.model = model
        self._log = EventLog()
        self.events = self._log.events
        self._state = initial_state(
            model,
            sample_rate=sample_rate,
            forgetting=forgetting,
            initial_covariance=initial_covariance,
            bound=bound,
            normalise=normalise,
            window=window,
            level_floor=level_floor,
            min_eigenvalue=min_eigenvalue,
            max_pull=max_pull,
            jump_ratio=jump_ratio,
            jump_time=jump_time,
            stuck_after=stuck_after,
            gap=gap,
        )
        self._look_into(self._state)
        self.reset_covariance()
        if theta0 is not None:
            self._begin_at(np.asarray(theta0, dtype=float))

    def _look_into(self, state: NDArray[np.float64]) -> None:
        """Keep views of the parts of the state."""
        views = layout.split(state)
        self._header, self._theta, self._d, self._phi = views[:4]
        views[6][:] = 1.0 / np.array(self.model.scale)
        self._level, self._peak = views[7:9]
        self._u, self._start, self._pull = views[10], views[12], views[13]
        self._pull[:] = math.inf

    def _begin_at(self, start: NDArray[np.float64]) -> None:
        """Begin with an estimate (n,) in physical units."""
        n = self.model.n_parameters
        if start.shape != (n,) or not np.all(np.isfinite(start)):
            raise ParameterError(
                f"theta0 of shape {start.shape} came; {n} finite values are expected: {', '.join(self.model.names)}"
            )
        self._theta[:] = start / self.model.to_physical
        self._start[:] = self._theta

    def update(self, sample: Sample | Sequence[float]) -> bool:
        """Take one sample.

        Args:
            sample: (time, force, displacement, velocity, acceleration), as a `Sample` or any sequence of five numbers.

        Returns:
            True if all went well; False if the sample raised something (see `events`) or held nothing to learn from.
        """
        time, force, x, v, a = sample
        flags = stream.update(self._state, time, force, x, v, a)
        if flags:
            self._log.note(flags, time, int(self._header[layout.SEEN]))
            return not flags & _TROUBLE
        return True

    def update_regressor(self, time: float, z: float, phi: NDArray[np.float64]) -> bool:
        """Take one sample of a `given_model`.

        Args:
            time: Time stamp [s].
            z: Measurement.
            phi: Regressor (n,), float64 and contiguous.

        Returns:
            As `update`.

        Raises:
            IdentificationError: phi has another length than the model.
        """
        if len(phi) != self._theta.size:
            raise IdentificationError(
                f"a regressor of {len(phi)} terms came; the model has {self._theta.size}"
            )
        flags = stream.update_given(self._state, time, z, phi)
        if flags:
            self._log.note(flags, time, int(self._header[layout.SEEN]))
            return not flags & _TROUBLE
        return True

    def run(
        self,
        time: ArrayLike,
        *,
        force: ArrayLike,
        displacement: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        every: int = 1,
        keep_regressors: bool = False,
    ) -> AdaptiveHistory:
        """Take a whole record, or the next part of one, in the compiled loop.

        Args:
            time: Time stamps (n,) [s].
            force: F (n,).
            displacement: x (n,).
            velocity: x' (n,).
            acceleration: x'' (n,).
            every: Keep the estimate of every so many samples.
            keep_regressors: Keep phi as well, for the contributions of the terms.

        Returns:
            The course of the estimation; the estimator itself stands at its end.

        Raises:
            RecordingError: A channel the model reads is missing, or lengths differ.
        """
        stamps = np.ascontiguousarray(time, dtype=float)
        channels = []
        for name, used, values in zip(
            CHANNELS, self.model.uses, (force, displacement, velocity, acceleration), strict=True
        ):
            if values is None and used:
                raise RecordingError(f"channel '{name}' is missing; the {self.model.kind} model reads it")
            array = (
                np.broadcast_to(np.nan, stamps.shape) if values is None else np.asarray(values, dtype=float)
            )
            if array.shape != stamps.shape or stamps.ndim != 1:
                raise RecordingError(
                    f"channel '{name}' of shape {array.shape} came; time has {stamps.shape}, one row is expected"
                )
            channels.append(np.ascontiguousarray(array))
        return self._run(stream.run, stamps, channels, every, keep_regressors)

    def run_regressors(
        self, time: ArrayLike, z: ArrayLike, phi: ArrayLike, *, every: int = 1, keep_regressors: bool = False
    ) -> AdaptiveHistory:
        """Take a whole record of a `given_model`.

        Args:
            time: Time stamps (n,) [s].
            z: Measurements (n,).
            phi: Regressors (n, n_parameters).
            every: Keep the estimate of every so many samples.
            keep_regressors: Keep phi in the history as well.

        Returns:
            As `run`.

        Raises:
            RecordingError: Shapes do not fit.
        """
        stamps, measured, rows = (np.ascontiguousarray(values, dtype=float) for values in (time, z, phi))
        if (
            stamps.ndim != 1
            or measured.shape != stamps.shape
            or rows.shape != (stamps.size, self._theta.size)
        ):
            raise RecordingError(
                f"time {stamps.shape}, z {measured.shape} and phi {rows.shape} came; "
                f"(n,), (n,) and (n, {self._theta.size}) are expected"
            )
        return self._run(stream.run_given, stamps, [measured, rows], every, keep_regressors)

    def _run(self, loop, stamps, channels, every, keep_regressors) -> AdaptiveHistory:
        every = max(int(every), 1)
        n = self._theta.size
        rows = -(-stamps.size // every)
        theta = np.empty((rows, n))
        phi = np.empty((rows if keep_regressors else 0, n))
        z = np.empty((rows, 2))
        flags = np.empty(stamps.size, dtype=np.int16)
        steps = np.diff(stamps[np.isfinite(stamps)])
        span = float(np.sum(steps[steps > 0.0])) if stamps.size else 0.0
        halves = int(min(span / self._header[layout.HALF_WINDOW], stamps.size)) + 2
        reports = np.empty((halves, 5 + n))
        seen, made = int(self._header[layout.SEEN]), self._log.made
        loop(self._state, stamps, *channels, every, theta, phi, z, flags, reports)
        for k in np.flatnonzero(flags & SETTINGS.bits):
            self._log.note(int(flags[k]), float(stamps[k]), seen + int(k) + 1)
        reports = reports[: int(self._header[layout.REPORTS])]
        if reports.shape[0]:
            self._log.report_time = float(reports[-1, 0])
        fresh = min(self._log.made - made, len(self.events))
        theta *= self.model.to_physical
        phi *= np.array(self.model.scale)
        history = AdaptiveHistory(
            time=stamps[::every].copy(),
            theta=theta,
            measured=z[:, 0] * self.model.force_scale,
            predicted=z[:, 1] * self.model.force_scale,
            regressors=phi,
            flags=flags,
            persistence=PersistenceHistory.of_rows(reports),
            events=tuple(self.events)[len(self.events) - fresh :],
        )
        for array in (*history[:6], *history.persistence):
            array.flags.writeable = False
        return history

    def reset_covariance(self) -> None:
        """Set P back to its start; the estimates stay (Ioannou and Sun 1996, section 4.3.7)."""
        reset_covariance(self._header, self._d, self._u)
        self._start[:] = self._theta
        self._header[layout.T_RESET] = (
            self._header[layout.T_LAST] if self._header[layout.STARTED] else -math.inf
        )

    @property
    def theta(self) -> NDArray[np.float64]:
        """Present estimates (n,), physical."""
        return self._theta * self.model.to_physical

    @property
    def contributions(self) -> NDArray[np.float64]:
        """``theta_i phi_i`` of the last sample (n,), in the unit of z."""
        return self._theta * self._phi * self.model.force_scale

    @property
    def covariance(self) -> NDArray[np.float64]:
        """P of the physical parameters (n, n), symmetric and positive definite.

        It is the inverse information of the law; times the spectral density of the noise of z [z^2 s] it estimates the
        covariance of theta.
        """
        n = self._d.size
        upper = np.triu(self._u.T, 1) + np.eye(n)
        root = self.model.to_physical[:, None] * upper * np.sqrt(self._d)
        return root @ root.T

    @property
    def factors(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """U (n, n), unit upper triangular, and D (n,) of the scaled parameters' ``P = U D U^T``."""
        return np.triu(self._u.T, 1) + np.eye(self._d.size), self._d.copy()

    @property
    def persistence(self) -> PersistenceReport:
        """The last report of the monitor."""
        silent = ~(self._level > self._header[layout.LEVEL_FLOOR] * self._peak)
        return PersistenceReport(
            time=self._log.report_time,
            smallest_eigenvalue=float(self._header[layout.SMALLEST]),
            condition=float(self._header[layout.CONDITION]),
            level=self._level.copy(),
            unexcited=self._named(silent) if math.isfinite(self._log.report_time) else (),
            trusted=self.trusted,
            ruled_by_start=self._named(~(self._pull <= self._header[layout.MAX_PULL])),
        )

    def _named(self, chosen: NDArray[np.bool_]) -> tuple[str, ...]:
        """Names of chosen parameters."""
        return tuple(name for name, one in zip(self.model.names, chosen, strict=True) if one)

    @property
    def trusted(self) -> bool:
        """Whether the estimates may be trusted now.

        A full window, persistently excited, no channel standing still, and no parameter that the start values and the initial
        covariance still rule (`persistence.ruled_by_start`; a larger `initial_covariance` or a longer record helps).
        """
        return bool(self._header[layout.TRUSTED] == 1.0 and self._header[layout.HELD] == 0.0)

    @property
    def used(self) -> int:
        """Number of samples learnt from."""
        return int(self._header[layout.USED])

    @property
    def out_of_phase(self) -> int:
        """Number of samples the damper model could not hold, force and velocity being opposed."""
        return int(self._header[layout.OUT_OF_PHASE])
