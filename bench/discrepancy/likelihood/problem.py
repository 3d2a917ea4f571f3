"""The statistical problem of a case: predictions, residuals in units of their noise, and priors.

Residuals are compared in the frequency domain, up to the frequency where the response sinks into its noise, and are
whitened there: besides the noise of the response channels, the noise of a measured load drives the free run
and leaves residuals at the resonance, correlated between channels, which a plain weighting would take for an effect.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor, raised_noise
from bench.discrepancy.effects.effect import Scales
from bench.discrepancy.likelihood.model_error import ModelError
from bench.discrepancy.likelihood.noise_covariance import sensor_gains, whitening_behind
from bench.discrepancy.likelihood.time_varying_noise import whitening_together
from bench.discrepancy.likelihood.whitening import RecordData, band_bins, projected, timed, without_bridged
from bench.discrepancy.likelihood.window_whitening import (
    Windows,
    cut,
    drifts,
    in_motion,
    measured_states,
    restarted,
    start_priors,
    start_responses,
    windows_of,
    with_starts,
    without_starts,
)
from bench.discrepancy.model.nominal_elements import with_own_forces
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.model.structure import Place, Structure
from bench.discrepancy.motion.measured import measured_motion
from bench.discrepancy.motion.observer import ACCELERATION
from bench.discrepancy.motion.prescribed import Prescribed, decided, prescribed_motion
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.response.driving_loads import driving_loads, fewest_steps, run_in
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings
from bench.discrepancy.simulation.prescribed_response import driven_force
from bench.discrepancy.simulation.step_size import rates, speeds, steps
from bench.discrepancy.simulation.stick_slip import COLUMNS, Elements, Motion

Array = NDArray[np.float64]


@dataclass
class Problem:
    """Records, structure and priors on a set of degrees of freedom.

    Attributes:
        case: The case.
        structure: Its structure, restricted to the degrees of freedom at hand.
        records: Records to be explained.
        bins: Frequency bins of every record, where they have to agree with those of another problem.
        substeps: Integration steps a sample; chosen by the fastest rate where None.
        refinement: Multiple of the steps so chosen, as far as `step_size` lets it.
        within: Stated standard deviations that a nominal parameter may move.
        settings: Thresholds of the diagnosis.
        error: Error of the model that residuals are weighed by besides their noise; None where noise is all that they hold.
        nominal: (n_nominal,) values of the structure's parameters, initial states of records in motion after them.
        spread: (n_nominal,) their one-sigma uncertainties.
        noise: (n_channels,) noise of the response channels.
        load_noise: (n_loads,).
        n_physical: Number of parameters of the structure proper.
        windowed: Whether free runs would drift, so that records are cut into windows.
        passed: Effects and vector of the model that the noise of what drives it passes into the residuals.
    """

    case: Case
    structure: Structure
    records: tuple[CaseRecord, ...]
    bins: Mapping[str, int] | None = None
    substeps: int | None = None
    refinement: int = 1
    error: ModelError | None = None
    within: float = np.inf
    settings: DiagnosisSettings = DEFAULT
    nominal: Array = field(init=False)
    spread: Array = field(init=False)
    noise: Array = field(init=False)
    load_noise: Array = field(init=False)
    data: tuple[RecordData, ...] = field(init=False)
    motions: dict[str, Motion] = field(init=False, default_factory=dict)
    n_physical: int = field(init=False)
    windowed: bool = field(init=False)
    passed: tuple[Hypothesis, Array] = field(init=False)

    def __post_init__(self) -> None:
        self.structure = without_starts(self.structure)
        table = {p.name: p for p in self.case.parameters}
        self.nominal = np.array([table[name].value for name in self.structure.parameters])
        self.spread = np.array([table[name].std for name in self.structure.parameters])
        self.noise = np.array([self._noise_of(name) for name in self.structure.channels])
        self.load_noise = np.array(
            [self.case.channel(name).noise_std or 0.0 for name in self.structure.loads]
        )
        self.n_physical = len(self.nominal)
        duration = max(len(record) * record.step for record in self.records)
        self.windowed = not self.driven and drifts(self.structure, self.structure.at(self.nominal), duration)
        if not self.driven and not self.windowed:
            self.structure = with_starts(self.structure, self.records)
            mean, std = start_priors([self.motion_of(r) for r in self.records if in_motion(r)])
            self.nominal, self.spread = np.append(self.nominal, mean), np.append(self.spread, std)
        self.passed = ((), np.zeros(len(self.nominal)))
        self.data = tuple(self.prepare(record) for record in self.records)

    def _noise_of(self, name: str) -> float:
        stated = self.case.channel(name).noise_std
        if stated is not None and stated > 0:
            return max(
                raised_noise(stated, record.values[name], settings=self.settings.case)
                for record in self.records
            )
        return max(noise_floor(record.values[name]) for record in self.records)

    def prepare(self, record: CaseRecord, passed: tuple[Hypothesis, Array] | None = None) -> RecordData:
        """Prepare a record for comparison.

        Args:
            record: The record.
            passed: Effects and vector of the model that noise passes on its way into the residuals; `passed` where None.
        """
        passed = passed or self.passed
        loads = np.column_stack([record.values[name] for name in self.structure.loads])
        responses = np.column_stack([record.values[name] for name in self.structure.channels])
        n_bins = (
            self.bins[record.name]
            if self.bins and record.name in self.bins
            else band_bins(responses, self.noise, settings=self.settings.likelihood)
        )
        windows = self._weighed_windows(windows_of(self, record, n_bins, self.split(*passed)[0]))
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

    def _weighed_windows(self, windows: Windows | None) -> Windows | None:
        """Windows, weighed by the error of the model besides."""
        if windows is None or self.error is None:
            return windows
        factor = np.sqrt(self._window_weight(windows) / self.error.scale)
        return windows._replace(weights=windows.weights * factor)

    def _window_weight(self, windows: Windows) -> float:
        """How much each residual of windows counts."""
        return 1.0 if self.error is None else self.error.window_weight(windows.n_residuals)

    def behind(self, hypothesis: Hypothesis, vector: Array) -> Problem:
        """The same records, their noise as an explanation passes it on."""
        out = copy.copy(self)
        out.passed = (hypothesis, vector)
        out.data = tuple(out.prepare(record) for record in self.records)
        return out

    def prescribed(self, record: CaseRecord) -> Prescribed:
        """Cached prescribed motion of a record, with draws of its noise."""
        cache = self.__dict__.setdefault("_prescribed", {})
        if record.name not in cache:
            cache[record.name] = prescribed_motion(
                self.case, record, self.settings.likelihood.motion_draws, settings=self.settings.motion
            )
        return cache[record.name]

    def load_noise_of(self, record: CaseRecord) -> Array:
        """Noise (n_loads,) of the loads of a record; one that is zero throughout has none."""
        driven = [bool(np.any(record.values[name])) for name in self.structure.loads]
        return np.where(driven, self.load_noise, 0.0)

    def acquired(self, channels: Array, record: CaseRecord) -> Array:
        """Channels (n, n_channels) behind the filters they passed on their way into a record; changed in place."""
        for c, name in enumerate(self.structure.channels):
            antialias = self.case.channel(name).antialias
            if antialias is not None and antialias.passed(record.name) and np.isfinite(channels[:, c]).all():
                channels[:, c] = antialias.apply(channels[:, c], record.step, periodic=record.periodic)
        return channels

    def lead_in(self, record: CaseRecord) -> int:
        """Samples of run-in before a periodic record, see `driving_loads.run_in`."""
        if not record.periodic or self.driven or self.windowed:
            return 0
        return run_in(
            self.structure.at(self.nominal), len(record), record.step, settings=self.settings.response
        )

    @cached_property
    def finest(self) -> int:
        """Fewest integration steps a sample, see `driving_loads.fewest_steps`."""
        return fewest_steps(self)

    def motion(self, index: int) -> Motion:
        """Smoothed measured motion of every degree of freedom in record `index`."""
        return self.motion_of(self.records[index])

    def motion_of(self, record: CaseRecord) -> Motion:
        """Smoothed measured motion of any record of the case."""
        if record.name not in self.motions:
            self.motions[record.name] = (
                self.prescribed(record).motion if self.driven else self.smoothed(record)
            )
        return self.motions[record.name]

    def smoothed(self, record: CaseRecord) -> Motion:
        """Motion behind the response channels of a record of this structure."""
        told = (*self.structure.observers, *self.structure.prescribed)
        samples = np.column_stack([record.values[observer.channel] for observer in told])
        prescribed = [self._noise_of(observer.channel) for observer in self.structure.prescribed]
        rest = not in_motion(record)
        return measured_motion(
            told,
            samples,
            np.append(self.noise, prescribed),
            record.step,
            at_rest=rest,
            settings=self.settings.motion,
        )

    def scales(self, place: Place) -> Scales:
        """Magnitudes along the coordinates of a place, over all records."""
        count = len(place.rows)
        position, velocity, acceleration = np.zeros(count), np.zeros(count), 0.0
        for i in range(len(self.records)):
            motion = self.motion(i)
            position = np.maximum(position, np.abs(motion.position @ place.rows.T).max(axis=0))
            velocity = np.maximum(velocity, np.abs(motion.velocity @ place.rows.T).max(axis=0))
            acceleration = max(acceleration, float(np.abs(motion.acceleration @ place.rows[0]).max()))
        position[position == 0.0] = 1.0
        velocity[velocity == 0.0] = 1.0
        force = np.array([self._loading(row) for row in place.rows])
        stiffness = force[0] / position[0]
        if place.stiffness in self.structure.parameters:
            stiffness = self.nominal[self.structure.parameters.index(place.stiffness)] or stiffness
        damping = 0.0
        if place.damping in self.structure.parameters:
            damping = self.nominal[self.structure.parameters.index(place.damping)]
        record = self.records[0]
        return Scales(
            float(force[0]), float(position[0]), float(velocity[0]), float(stiffness), len(record) * record.step,
            record.step, float(force[-1]), float(position[-1]), float(velocity[-1]),
            acceleration or 1.0, float(damping), mobility=self._mobility(place.rows[0]),
        )  # fmt: skip

    def _mobility(self, row: Array) -> float:
        """Acceleration along a coordinate (n_dof,) that a unit force along it gives the nominal model."""
        if self.driven:
            return 0.0
        return float(row @ np.linalg.solve(self.structure.at(self.nominal).mass, row))

    def _loading(self, row: Array) -> float:
        """RMS load of the group of degrees of freedom that a coordinate belongs to; that of its inertia where nothing drives it."""
        if self.driven:
            return float(np.sqrt(np.mean([float(np.mean(d.responses**2)) for d in self.data]))) or 1.0
        group = next(g for g in self.structure.groups() if np.any(row[list(g)] != 0.0))
        acting = np.abs(self.structure.inputs[list(group)]).sum(axis=0) > 0
        power = [float(np.mean(d.loads[:, acting] ** 2)) for d in self.data] if acting.any() else [0.0]
        # of a prescribed motion the load is an acceleration
        if not any(power) or self.structure.prescribed:
            moved = [self.motion(i).acceleration @ row for i in range(len(self.records))]
            power = [float(np.mean((a / self._mobility(row)) ** 2)) for a in moved]
        return float(np.sqrt(np.mean(power))) or 1.0

    def simulate(
        self,
        hypothesis: Hypothesis,
        vector: Array,
        record: CaseRecord,
        *,
        starts: Array | None = None,
        own_forces: bool = True,
    ) -> Array:
        """Free run of a hypothesis.

        Args:
            hypothesis: Effects.
            vector: Deviations of the nominal parameters in units of their uncertainty, then the etas of all effects.
            record: Record whose loads drive the run.
            starts: (n_windows, 2 n_dof) positions and velocities at `firsts`; those of `starts_of` where None.
            own_forces: Whether the nominal model keeps its own dry friction and bending springs.

        Returns:
            (n, n_channels) predicted responses; NaN where it diverged.
        """
        values, etas = self.split(hypothesis, vector)
        if self.driven:
            return self._driven_response(hypothesis, etas, values, record)
        motion = self.free_motion(hypothesis, vector, record, starts=starts, own_forces=own_forces)
        channels = self.observe(hypothesis, etas, motion, record.step)
        return self.acquired(self.picked_up(hypothesis, etas, channels, record), record)

    def free_motion(
        self,
        hypothesis: Hypothesis,
        vector: Array,
        record: CaseRecord,
        *,
        starts: Array | None = None,
        own_forces: bool = True,
    ) -> Motion:
        """Motion of a free run, of which `simulate` returns what is measured; the arguments are the same."""
        values, etas = self.split(hypothesis, vector)
        lead = self.lead_in(record)
        linear = self.structure.at(values)
        elements, rates = self.elements(hypothesis, etas, record)
        if own_forces:
            elements = self._with_own(elements, hypothesis, values)
        # The rate of a law is that at its largest velocity, where a step of one time constant is still accurate enough.
        own = np.sqrt(np.max(np.abs(linear.stiffness).sum(1) / np.diag(linear.mass)))
        own = max([own, *(friction.rate(linear.mass) for friction in self.structure.frictions)])
        substeps = self._substeps(
            record.step * np.maximum(0.6 * np.maximum(rates, self._own_rate(record)), own)
        )
        if lead and len(substeps) > 1:
            substeps = np.resize(substeps, lead + len(record))
        loads, factor = driving_loads(self, (hypothesis, etas), record, int(substeps.max()))
        motion = restarted(
            linear,
            elements,
            loads=loads,
            load_factor=factor,
            step=record.step,
            substeps=substeps,
            start_time=record.start - lead * record.step,
            firsts=self.firsts(record),
            starts=self.starts_of(record, values) if starts is None else starts,
            motion=self.motion_of(record) if self.windowed else None,
        )
        return Motion(*(samples[lead:] for samples in motion))

    def _with_own(self, elements: Elements, hypothesis: Hypothesis, values: Array) -> Elements:
        """Elements with the nominal model's own forces, but for friction that an effect stands in the place of."""
        replaced = [placed.place.rows[0] for placed in hypothesis if placed.effect.in_place]
        return with_own_forces(elements, self.structure, values, replaced)

    def _own_rate(self, record: CaseRecord) -> float:
        """Cached fastest rate of the laws of the nominal model [1/s]; that of a measured record where one was not measured."""
        cache = self.__dict__.setdefault("_own_rates", {})
        if not self.structure.elements:
            return 0.0
        if record.name not in cache:
            known = any(own is record for own in (*self.case.identification, *self.case.validation))
            motion = self.motion_of(record if known else self.records[0])
            laws = self.structure.elements
            cache[record.name] = max(
                law.rate(law.theta(self.structure.parameters, self.nominal), motion, record.step)
                for law in laws
            )
        return cache[record.name]

    def _substeps(self, phase: Array) -> NDArray[np.int64]:
        """Integration steps of samples in which the fastest law changes by a `phase` (n,), or (1,) of all of them."""
        if self.substeps is not None:
            return np.array([self.substeps])
        # loads known between their samples are given at the steps of the finest sample
        halving = self.case.load_interpolation == "band_limited"
        return steps(
            phase,
            fewest=self.finest,
            multiple=self.refinement,
            halving=halving,
            settings=self.settings.simulation,
        )

    def firsts(self, record: CaseRecord) -> NDArray[np.int64]:
        """First samples (n_windows,) of the runs that a simulation of a record is made of."""
        return (
            cut(self.case, record, len(self.noise), settings=self.settings.likelihood)[0]
            if self.windowed
            else np.zeros(1, dtype=np.int64)
        )

    def starts_of(self, record: CaseRecord, values: Array) -> Array:
        """Initial states (n_windows, 2 n_dof): at rest, as fitted (in `values`), or as measured."""
        n_dof = len(self.structure.dofs)
        if not self.windowed and not in_motion(record):
            return np.zeros((1, 2 * n_dof))
        fitted = [r.name for r in self.records if in_motion(r)]
        if not self.windowed and record.name in fitted:
            first = self.n_physical + 2 * n_dof * fitted.index(record.name)
            return values[first : first + 2 * n_dof][None, :]
        return measured_states(self.motion_of(record), self.firsts(record))

    def _driven_response(
        self, hypothesis: Hypothesis, etas: list[Array], values: Array, record: CaseRecord
    ) -> Array:
        """Force (n, 1) of the component along the prescribed motion of a record."""
        motion = self.motion_of(record)
        linear = self.structure.at(values)
        force = motion.position @ linear.stiffness + motion.velocity @ linear.damping
        elements, rates = self.elements(hypothesis, etas, record)
        elements = self._with_own(elements, hypothesis, values)
        if len(elements.table):
            row = elements.rows.T
            driven = driven_force(
                elements,
                position=motion.position @ row,
                velocity=motion.velocity @ row,
                step=record.step,
                substeps=steps(
                    record.step * np.maximum(rates, self._own_rate(record)), settings=self.settings.simulation
                ),
                start_time=record.start,
            )
            if not np.isfinite(driven).all():
                return np.full_like(force, np.nan)
            force += driven @ elements.rows
        return self.sensed(hypothesis, etas, force, record.step)

    def finer(self, refinement: int) -> Problem:
        """A copy that is integrated in other steps."""
        out = copy.copy(self)
        out.refinement = refinement
        return out

    def bounded(self, within: float) -> Problem:
        """A copy whose nominal parameters move by so many stated standard deviations at most."""
        out = copy.copy(self)
        out.within = within
        return out

    def beside(self, records: Sequence[CaseRecord]) -> Problem:
        """A copy of all records and further ones that start at rest; the scales of the effects stay, and so do vectors."""
        out = copy.copy(self)
        out.records = (*self.records, *records)
        out.data = (*self.data, *(self.prepare(record) for record in records))
        return out

    def forgetful(self) -> Problem:
        """A copy without what is kept by the name of a record: for records of the same names with other samples."""
        out = copy.copy(self)
        out.motions = {}
        out.__dict__["_loads"] = {}
        out.__dict__["_prescribed"] = {}
        out.__dict__["_speeds_along"] = {}
        return out

    def observe(self, hypothesis: Hypothesis, etas: list[Array], motion: Motion, step: float) -> Array:
        """Channels (n, n_channels) of a motion, sensor effects included."""
        out = np.column_stack([motion[o.order] @ o.row for o in self.structure.observers])
        return self.sensed(hypothesis, etas, out, step)

    def sensed(self, hypothesis: Hypothesis, etas: list[Array], channels: Array, step: float) -> Array:
        """Channels (n, n_channels) behind the sensor effects of a hypothesis; changed in place."""
        for placed, eta in zip(hypothesis, etas, strict=True):
            if placed.effect.site == "sensor" and placed.effect.signal is not None:
                c = self.structure.channels.index(placed.target)
                values = placed.effect.values(eta, self.scales_of(placed))
                channels[:, c] = placed.effect.signal(channels[:, c], values, step)
        return channels

    def picked_up(
        self, hypothesis: Hypothesis, etas: list[Array], channels: Array, record: CaseRecord
    ) -> Array:
        """Channels (n, n_channels) with what they pick up from other measured channels; changed in place."""
        for placed, eta in zip(hypothesis, etas, strict=True):
            if placed.effect.pickup:
                share = placed.effect.values(eta, self.scales_of(placed))[0]
                channels[:, self.structure.channels.index(placed.channel)] += (
                    share * record.values[placed.source]
                )
        return channels

    def scales_of(self, placed: Placed) -> Scales:
        """Cached `scales` of the place of an effect, with the size of the channel it picks up."""
        cache = self.__dict__.setdefault("_scales", {})
        if placed.place.name not in cache:
            cache[placed.place.name] = self.scales(placed.place)
        if not placed.source:
            return cache[placed.place.name]
        if placed.key not in cache:
            largest = max(float(np.abs(record.values[placed.source]).max()) for record in self.records)
            cache[placed.key] = cache[placed.place.name]._replace(source=largest or 1.0)
        return cache[placed.key]

    def split(self, hypothesis: Hypothesis, vector: Array) -> tuple[Array, list[Array]]:
        """Nominal parameter values, and the etas of every effect; inertia effects already applied to the values."""
        n = len(self.nominal)
        values = self.nominal + self.spread * vector[:n]
        etas = []
        for placed in hypothesis:
            etas.append(vector[n : n + len(placed.effect.parameters)])
            n += len(placed.effect.parameters)
            if placed.effect.site == "inertia":
                i = self.structure.parameters.index(placed.target)
                values[i] *= 1.0 + placed.effect.values(etas[-1], self.scales_of(placed))[0]
        return values, etas

    def elements(
        self, hypothesis: Hypothesis, etas: list[Array], record: CaseRecord
    ) -> tuple[Elements, Array]:
        """Force laws of a hypothesis, and the fastest rate among them [1/s] at every sample (n,), or (1,) for all samples."""
        rows, theta, table = [], [], []
        n_rows = n_theta = n_states = 0
        fastest = np.zeros(1)
        for placed, eta in zip(hypothesis, etas, strict=True):
            effect = placed.effect
            if effect.site != "joint" or effect.law is None:
                continue
            scales = self.scales_of(placed)._replace(duration=len(record) * record.step)
            parameters = effect.kernel_theta(eta, scales)
            if effect.of_record is not None:
                parameters = effect.of_record(effect.values(eta, scales), record.name)
            schedule = effect.schedule(effect.values(eta, scales), record) if effect.schedule else np.zeros(0)
            table.append(
                [
                    *effect.addresses, effect.n_coordinates, n_rows, n_theta, n_states, len(effect.law.states),
                    1 + n_theta + len(parameters) if effect.schedule else 0,
                ]
            )  # fmt: skip
            own = rates(
                effect,
                effect.values(eta, scales),
                scales,
                self._speeds(placed, record),
                settings=self.settings.simulation,
            )
            fastest = np.maximum(fastest, own)
            rows.append(placed.place.rows)
            theta += [parameters, schedule]
            n_rows += effect.n_coordinates
            n_theta += len(parameters) + len(schedule)
            n_states += len(effect.law.states)
        n_dof = len(self.structure.dofs)
        return (
            Elements(
                np.array(table, dtype=np.int64).reshape(-1, COLUMNS),
                np.vstack(rows) if rows else np.zeros((0, n_dof)),
                np.concatenate([*theta, [0.0]]),
                np.zeros(n_states),
            ),
            fastest,
        )

    def _speeds(self, placed: Placed, record: CaseRecord) -> Array:
        """Cached speeds along the coordinate of an effect, see `step_size.speeds`; (1,) where the record was not measured."""
        if not any(own is record for own in self.records):
            return np.array([self.scales_of(placed).velocity])
        cache = self.__dict__.setdefault("_speeds_along", {})
        if (record.name, placed.place.name) not in cache:
            velocity = self.motion_of(record).velocity @ placed.place.rows[0]
            cache[record.name, placed.place.name] = speeds(
                velocity, prescribed=self.driven, settings=self.settings.simulation
            )
        return cache[record.name, placed.place.name]

    def residual(self, hypothesis: Hypothesis, vector: Array) -> Array:
        """Whitened residuals of all records, real and imaginary parts stacked; their sum of squares is chi-squared."""
        parts = in_threads(lambda data: self.residual_of(data, hypothesis, vector), self.data)
        finite = [part for part in parts if part is not None]
        return np.concatenate(finite) if len(finite) == len(parts) else np.array([np.inf])

    def residual_of(
        self, data: RecordData, hypothesis: Hypothesis, vector: Array, *, lenient: bool = True
    ) -> Array | None:
        """Whitened residuals of one record, jumps that come a little early or late excused if `lenient`; None where it diverged."""
        predicted = self.simulate(hypothesis, vector, data.record)
        if not np.isfinite(predicted).all():
            return None
        moved = start_responses(self, hypothesis, vector, data.record, predicted) if self.windowed else ()
        residual = data.responses - predicted
        excused = lenient and hypothesis and not self.driven
        for c, observer in enumerate(self.structure.observers if excused else ()):
            if observer.order == ACCELERATION:
                residual[:, c] = timed(
                    residual[:, c], predicted[:, c], self.noise[c], settings=self.settings.likelihood
                )
        return projected(residual, moved, data, settings=self.settings.likelihood)

    @property
    def noise_stated(self) -> bool:
        """Whether the noise of every response channel is stated, so that chi-squared has an absolute meaning."""
        return all((self.case.channel(name).noise_std or 0.0) > 0.0 for name in self.structure.channels)

    @property
    def scaled(self) -> bool:
        """Whether chi-squared has an absolute meaning: by the stated noise, or by the error of the model."""
        return self.noise_stated or self.error is not None

    @property
    def driven(self) -> bool:
        """Whether the motion is prescribed and the force is the response."""
        return self.case.rig == "damper"

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
