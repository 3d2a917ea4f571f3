"""The simulator of a case: from a hypothesis, its parameters and a record to the channels that would have been measured."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.model.nominal_elements import with_own_forces
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.motion.prescribed import earlier
from bench.discrepancy.response.driving_loads import Actuated, driving_loads, fewest_steps, run_in
from bench.discrepancy.response.force_laws import ActingLaw, assembled
from bench.discrepancy.response.initial_states import in_motion
from bench.discrepancy.response.measured_case import MeasuredCase
from bench.discrepancy.response.windows import cut
from bench.discrepancy.simulation.prescribed_response import driven_force
from bench.discrepancy.simulation.restarts import measured_states, restarted
from bench.discrepancy.simulation.step_size import steps
from bench.discrepancy.simulation.stick_slip import Elements, Motion, StructureMatrices


@dataclass
class Simulator(MeasuredCase):
    """Predictions of the response channels by a nominal model and hypotheses beside it.

    Attributes:
        substeps: Integration steps a sample; chosen by the fastest rate where None.
        refinement: Multiple of the steps so chosen, as far as `step_size` lets it.
    """

    substeps: int | None = None
    refinement: int = 1
    _loads: dict[tuple[str, int, int, int], tuple[Array, int]] = field(
        init=False, repr=False, default_factory=dict
    )
    _own_rates: dict[str, float] = field(init=False, repr=False, default_factory=dict)

    def finer(self, refinement: int) -> Self:
        """A copy that is integrated in other steps."""
        out = copy.copy(self)
        out.refinement = refinement
        return out

    def forgetful(self) -> Self:
        """A copy without what is kept by the name of a record: for records of the same names with other samples."""
        out = copy.copy(self)
        out.motions, out._prescribed, out._loads, out._speeds = {}, {}, {}, {}
        return out

    def moving(self, motions: dict[str, Motion]) -> Self:
        """A copy whose records move as told, by their names."""
        out = copy.copy(self)
        out.motions = motions
        return out

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

    def linear(self, hypothesis: Hypothesis, etas: list[Array], values: Array) -> StructureMatrices:
        """Matrices at nominal values (n_parameters,), less the inertia that effects of a hypothesis carry themselves.

        A nominal mass may be far off on the way of a fit: of what it is there, no more is taken than the largest share.
        """
        linear = self.structure.at(values)
        for placed, eta in zip(hypothesis, etas, strict=True):
            if carried := self.carried(placed, eta):
                row, share = placed.place.rows[0], placed.effect.parameters[0]
                whole = 1.0 / float(row @ np.linalg.solve(linear.mass, row))
                most = share.value(share.bounds[1], self.scales_of(placed)) * whole
                linear = linear._replace(mass=linear.mass - min(carried, most) * np.outer(row, row))
        return linear

    def carried(self, placed: Placed, eta: Array) -> float:
        """Inertia along its coordinate that an effect moves instead of the nominal model; zero for most."""
        if placed.effect.carried is None:
            return 0.0
        scales = self.scales_of(placed)
        return placed.effect.carried(placed.effect.values(eta, scales), scales)

    def simulate(
        self,
        hypothesis: Hypothesis,
        vector: Array,
        record: CaseRecord,
        *,
        starts: Array | None = None,
        own_forces: bool = True,
        motion: Motion | None = None,
    ) -> Array:
        """Free run of a hypothesis.

        Args:
            hypothesis: Effects.
            vector: Deviations of the nominal parameters in units of their uncertainty, then the etas of all effects.
            record: Record whose loads drive the run.
            starts: (n_windows, 2 n_dof) positions and velocities at `firsts`; those of `starts_of` where None.
            own_forces: Whether the nominal model keeps its own dry friction and bending springs.
            motion: What `free_motion` returns, where it is known: effects of sensors do not change it.

        Returns:
            (n, n_channels) predicted responses; NaN where it diverged.
        """
        values, etas = self.split(hypothesis, vector)
        if self.driven:
            return self._driven_response(hypothesis, etas, values, record)
        if motion is None:
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
        linear = self.linear(hypothesis, etas, values)
        elements, fastest = self.elements(hypothesis, etas, record)
        if own_forces:
            elements = self._with_own(elements, hypothesis, values)
        substeps = self._substeps(linear, fastest, record)
        if lead and len(substeps) > 1:
            substeps = np.resize(substeps, lead + len(record))
        loads, factor = self.driving_loads(hypothesis, etas, record, int(substeps.max()))
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

    def _driven_response(
        self, hypothesis: Hypothesis, etas: list[Array], values: Array, record: CaseRecord
    ) -> Array:
        """Force (n, 1) of the component along the prescribed motion of a record."""
        motion = self._answered(hypothesis, etas, record)
        linear = self.structure.at(values)
        force = motion.position @ linear.stiffness + motion.velocity @ linear.damping
        elements, fastest = self.elements(hypothesis, etas, record)
        elements = self._with_own(elements, hypothesis, values)
        if len(elements.table):
            row = elements.rows.T
            driven = driven_force(
                elements,
                position=motion.position @ row,
                velocity=motion.velocity @ row,
                step=record.step,
                substeps=steps(
                    record.step * np.maximum(fastest, self._own_rate(record)),
                    settings=self.settings.simulation,
                ),
                start_time=record.start,
            )
            if not np.isfinite(driven).all():
                return np.full_like(force, np.nan)
            force += driven @ elements.rows
        return self.picked_up(hypothesis, etas, self.sensed(hypothesis, etas, force, record.step), record)

    def _answered(self, hypothesis: Hypothesis, etas: list[Array], record: CaseRecord) -> Motion:
        """The prescribed motion that the component answers to at the samples of its force, by the delays of a hypothesis."""
        motion = self.motion_of(record)
        late = sum(
            placed.effect.later * float(placed.effect.values(eta, self.scales_of(placed))[0])
            for placed, eta in zip(hypothesis, etas, strict=True)
            if placed.effect.later
        )
        return earlier(motion, late, record.step) if late else motion

    def elements(
        self, hypothesis: Hypothesis, etas: list[Array], record: CaseRecord
    ) -> tuple[Elements, Array]:
        """Force laws of a hypothesis, and the fastest rate among them [1/s] at every sample (n,), or (1,) for all samples."""
        acting = [
            ActingLaw(
                placed,
                eta,
                self.scales_of(placed)._replace(duration=len(record) * record.step),
                self.speeds_of(placed, record),
            )
            for placed, eta in zip(hypothesis, etas, strict=True)
            if placed.effect.site == "joint" and placed.effect.law is not None
        ]
        return assembled(acting, record, len(self.structure.dofs), settings=self.settings.simulation)

    def _with_own(self, elements: Elements, hypothesis: Hypothesis, values: Array) -> Elements:
        """Elements with the nominal model's own forces, but for friction that an effect stands in the place of."""
        replaced = [placed.place.rows[0] for placed in hypothesis if placed.effect.in_place]
        return with_own_forces(elements, self.structure, values, replaced)

    def _own_rate(self, record: CaseRecord) -> float:
        """Fastest rate of the laws of the nominal model [1/s]; that of a measured record where one was not measured; kept."""
        if not self.structure.elements:
            return 0.0
        if record.name not in self._own_rates:
            known = any(own is record for own in (*self.case.identification, *self.case.validation))
            motion = self.motion_of(record if known else self.records[0])
            self._own_rates[record.name] = max(
                law.rate(law.theta(self.structure.parameters, self.nominal), motion, record.step)
                for law in self.structure.elements
            )
        return self._own_rates[record.name]

    def _substeps(self, linear: StructureMatrices, fastest: Array, record: CaseRecord) -> NDArray[np.int64]:
        """Integration steps of every sample of a record, or (1,) of all of them, by the fastest rate of the laws (n,) or (1,)."""
        if self.substeps is not None:
            return np.array([self.substeps])
        own = np.sqrt(np.max(np.abs(linear.stiffness).sum(1) / np.diag(linear.mass)))
        own = max([own, *(friction.rate(linear.mass) for friction in self.structure.frictions)])
        # the rate of a law is that at its largest velocity, where a step of one time constant is still accurate enough
        phase = record.step * np.maximum(0.6 * np.maximum(fastest, self._own_rate(record)), own)
        # loads known between their samples are given at the steps of the finest sample
        halving = self.case.load_interpolation == "band_limited"
        return steps(
            phase,
            fewest=self.finest,
            multiple=self.refinement,
            halving=halving,
            settings=self.settings.simulation,
        )

    @cached_property
    def finest(self) -> int:
        """Fewest integration steps a sample, see `driving_loads.fewest_steps`; one where loads are read as straight lines.

        Straight lines between samples are themselves only as good as the step rule; a load that is known between its samples
        deserves an integration that is not worse.
        """
        if self.case.load_interpolation == "linear" or self.driven:
            return 1
        still = np.zeros(len(self.nominal))

        def predict(substeps: int) -> Array:
            stepped = copy.copy(self)
            stepped.substeps = substeps
            return stepped.simulate((), still, self.records[0])

        return fewest_steps(predict, self.noise, settings=self.settings)

    def lead_in(self, record: CaseRecord) -> int:
        """Samples of run-in before a periodic record, see `driving_loads.run_in`."""
        if not record.periodic or self.driven or self.windowed:
            return 0
        linear = self.structure.at(self.nominal)
        return run_in(linear, len(record), record.step, settings=self.settings.response)

    def driving_loads(
        self, hypothesis: Hypothesis, etas: list[Array], record: CaseRecord, substeps: int
    ) -> tuple[Array, int]:
        """Loads of a record behind the actuator effects of a hypothesis, see `driving_loads`; without any they are kept."""
        acting = [
            Actuated(
                self.structure.loads.index(placed.target),
                operation,
                placed.effect.values(eta, self.scales_of(placed)),
                placed.effect.between_samples,
            )
            for placed, eta in zip(hypothesis, etas, strict=True)
            if placed.effect.site == "actuator"
            and (operation := placed.effect.on(self.case.load_interpolation).signal) is not None
        ]
        lead = self.lead_in(record)
        # a proposed test may bear the name of a record, but be no period of anything
        key = (record.name, len(record), lead, substeps)
        if not acting and key in self._loads:
            return self._loads[key]
        driving = driving_loads(
            self.loads_of(record),
            acting,
            interpolation=self.case.load_interpolation,
            step=record.step,
            substeps=substeps,
            lead=lead,
            periodic=record.periodic,
            settings=self.settings.response,
        )
        if not acting:
            self._loads[key] = driving
        return driving

    def firsts(self, record: CaseRecord) -> NDArray[np.int64]:
        """First samples (n_windows,) of the runs that a simulation of a record is made of."""
        if not self.windowed:
            return np.zeros(1, dtype=np.int64)
        return cut(self.case, record, len(self.noise), settings=self.settings.likelihood)[0]

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

    def start_differences(self, record: CaseRecord) -> Array:
        """Steps (2 n_dof,) of the finite differences by the entries of a start."""
        motion = self.motion_of(record)
        spread = np.concatenate([np.std(motion.position, axis=0), np.std(motion.velocity, axis=0)])
        return self.settings.likelihood.start_difference * np.where(spread > 0.0, spread, 1.0)

    def start_responses(
        self, hypothesis: Hypothesis, vector: Array, record: CaseRecord, predicted: Array
    ) -> list[Array]:
        """Change of the channels (n, n_channels) with each entry of the windows' starts, by finite differences.

        Args:
            hypothesis: Effects.
            vector: See `simulate`.
            record: The record.
            predicted: (n, n_channels) from the starts as measured.
        """
        starts = measured_states(self.motion_of(record), self.firsts(record))
        return [
            self.simulate(hypothesis, vector, record, starts=starts + step) - predicted
            for step in np.diag(self.start_differences(record))
        ]
