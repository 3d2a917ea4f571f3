"""What the records and the nominal model of a case say before any run: noise, motion and magnitudes.

What channels read of a motion belongs to it, sensor effects and the filters of the acquisition included.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field, replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.channel_noise import noise_floor, raised_noise
from bench.discrepancy.effects.effect import Scales
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.model.structure import Place, Structure
from bench.discrepancy.motion.measured import measured_motion
from bench.discrepancy.motion.prescribed import Prescribed, prescribed_motion
from bench.discrepancy.response.initial_states import in_motion, start_priors, with_starts, without_starts
from bench.discrepancy.response.windows import channels_of, drifts
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings
from bench.discrepancy.simulation.step_size import speeds
from bench.discrepancy.simulation.stick_slip import Motion


@dataclass
class MeasuredCase:
    """Records of a case, and its nominal model on a set of degrees of freedom.

    Attributes:
        case: The case.
        structure: Its structure, restricted to the degrees of freedom at hand.
        records: Records that noise and magnitudes are taken from: those to be explained.
        settings: Thresholds of the diagnosis.
        nominal: (n_nominal,) values of the structure's parameters, initial states of records in motion after them.
        spread: (n_nominal,) their one-sigma uncertainties.
        noise: (n_channels,) noise of the response channels.
        load_noise: (n_loads,).
        n_physical: Number of parameters of the structure proper.
        windowed: Whether free runs would drift, so that records are cut into windows.
        motions: Motion behind the records by their names, as far as it has been asked for.
    """

    case: Case
    structure: Structure
    records: tuple[CaseRecord, ...]
    _: KW_ONLY
    settings: DiagnosisSettings = DEFAULT
    nominal: Array = field(init=False)
    spread: Array = field(init=False)
    noise: Array = field(init=False)
    load_noise: Array = field(init=False)
    n_physical: int = field(init=False)
    windowed: bool = field(init=False)
    motions: dict[str, Motion] = field(init=False, repr=False, default_factory=dict)
    _prescribed: dict[str, Prescribed] = field(init=False, repr=False, default_factory=dict)
    _scales: dict[str | tuple[str, str, str], Scales] = field(init=False, repr=False, default_factory=dict)
    _speeds: dict[tuple[str, str], Array] = field(init=False, repr=False, default_factory=dict)

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

    def _noise_of(self, name: str) -> float:
        stated = self.case.channel(name).noise_std
        if stated is not None and stated > 0:
            return max(
                raised_noise(stated, record.values[name], settings=self.settings.case)
                for record in self.records
            )
        return max(noise_floor(record.values[name]) for record in self.records)

    @property
    def driven(self) -> bool:
        """Whether the motion is prescribed and the force is the response."""
        return self.case.rig == "damper"

    @property
    def noise_stated(self) -> bool:
        """Whether the noise of every response channel is stated, so that chi-squared has an absolute meaning."""
        return all((self.case.channel(name).noise_std or 0.0) > 0.0 for name in self.structure.channels)

    def loads_of(self, record: CaseRecord) -> Array:
        """Loads (n, n_loads) of a record."""
        return np.column_stack([record.values[name] for name in self.structure.loads])

    def responses_of(self, record: CaseRecord) -> Array:
        """Response channels (n, n_channels) of a record."""
        return np.column_stack([record.values[name] for name in self.structure.channels])

    def load_noise_of(self, record: CaseRecord) -> Array:
        """Noise (n_loads,) of the loads of a record; one that is zero throughout has none."""
        driven = [bool(np.any(record.values[name])) for name in self.structure.loads]
        return np.where(driven, self.load_noise, 0.0)

    def with_load_noise(self, record: CaseRecord, rng: np.random.Generator) -> CaseRecord:
        """A record with one more draw of the stated noise on its loads."""
        noisy = {
            name: record.values[name] + level * rng.standard_normal(len(record))
            for name, level in zip(self.structure.loads, self.load_noise_of(record), strict=True)
        }
        return replace(record, values={**record.values, **noisy})

    def prescribed(self, record: CaseRecord) -> Prescribed:
        """Prescribed motion of a record, with draws of its noise; kept."""
        if record.name not in self._prescribed:
            self._prescribed[record.name] = prescribed_motion(
                self.case, record, self.settings.likelihood.motion_draws, settings=self.settings.motion
            )
        return self._prescribed[record.name]

    def motion(self, index: int) -> Motion:
        """Smoothed measured motion of every degree of freedom in record `index`."""
        return self.motion_of(self.records[index])

    def motion_of(self, record: CaseRecord) -> Motion:
        """Smoothed measured motion of any record of the case; kept."""
        if record.name not in self.motions:
            self.motions[record.name] = (
                self.prescribed(record).motion if self.driven else self.smoothed(record)
            )
        return self.motions[record.name]

    def smoothed(self, record: CaseRecord) -> Motion:
        """Motion behind the response channels of a record of this structure."""
        prescribed = self.structure.prescribed
        driving = [record.values[observer.channel] for observer in prescribed]
        return measured_motion(
            (*self.structure.observers, *prescribed),
            np.column_stack([self.responses_of(record), *driving]),
            np.append(self.noise, [self._noise_of(observer.channel) for observer in prescribed]),
            record.step,
            at_rest=not in_motion(record),
            settings=self.settings.motion,
        )

    def speeds_of(self, placed: Placed, record: CaseRecord) -> Array:
        """Speeds along the coordinate of an effect, see `step_size.speeds`; (1,) where the record was not measured; kept."""
        if not any(own is record for own in self.records):
            return np.array([self.scales_of(placed).velocity])
        key = (record.name, placed.place.name)
        if key not in self._speeds:
            velocity = self.motion_of(record).velocity @ placed.place.rows[0]
            self._speeds[key] = speeds(velocity, prescribed=self.driven, settings=self.settings.simulation)
        return self._speeds[key]

    def scales_of(self, placed: Placed) -> Scales:
        """`scales` of the place of an effect, with the size of the channel it picks up; kept."""
        kept = self._scales
        if placed.place.name not in kept:
            kept[placed.place.name] = self.scales(placed.place)
        if not placed.source:
            return kept[placed.place.name]
        if placed.key not in kept:
            largest = max(float(np.abs(record.values[placed.source]).max()) for record in self.records)
            kept[placed.key] = kept[placed.place.name]._replace(source=largest or 1.0)
        return kept[placed.key]

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
        secant = stiffness = force[0] / position[0]
        if place.stiffness in self.structure.parameters:
            stiffness = self.nominal[self.structure.parameters.index(place.stiffness)] or stiffness
        if self.driven:
            # the force is the component's own: a weak spring in it is no measure of what else it holds
            stiffness = max(stiffness, secant)
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
            power = [float(np.mean(self.responses_of(record) ** 2)) for record in self.records]
            return float(np.sqrt(np.mean(power))) or 1.0
        group = next(g for g in self.structure.groups() if np.any(row[list(g)] != 0.0))
        gears = np.abs(self.structure.inputs[list(group)]).max(
            axis=0
        )  # of a servo's target, an angle, its gain
        acting = gears > 0
        power = [0.0]
        if acting.any():
            loads = [(self.loads_of(record) * gears)[:, acting] for record in self.records]
            power = [float(np.mean(own**2)) for own in loads]
        # of a prescribed motion the load is an acceleration
        if not any(power) or self.structure.prescribed:
            moved = [self.motion(i).acceleration @ row for i in range(len(self.records))]
            power = [float(np.mean((a / self._mobility(row)) ** 2)) for a in moved]
        return float(np.sqrt(np.mean(power))) or 1.0

    def observe(self, hypothesis: Hypothesis, etas: list[Array], motion: Motion, step: float) -> Array:
        """Channels (n, n_channels) of a motion, sensor effects included."""
        return self.sensed(hypothesis, etas, channels_of(self.structure, motion), step)

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
        """Channels (n, n_channels) with what they pick up: other measured channels, hum; changed in place."""
        for placed, eta in zip(hypothesis, etas, strict=True):
            if placed.effect.added is not None:
                values = placed.effect.values(eta, self.scales_of(placed))
                added = placed.effect.added(values, record.name, record.time)
                channels[:, self.structure.channels.index(placed.target)] += added
            if placed.effect.pickup:
                share = placed.effect.values(eta, self.scales_of(placed))[0]
                channels[:, self.structure.channels.index(placed.channel)] += (
                    share * record.values[placed.source]
                )
        return channels

    def acquired(self, channels: Array, record: CaseRecord) -> Array:
        """Channels (n, n_channels) behind the filters they passed on their way into a record; changed in place."""
        for c, name in enumerate(self.structure.channels):
            antialias = self.case.channel(name).antialias
            if antialias is not None and antialias.passed(record.name) and np.isfinite(channels[:, c]).all():
                channels[:, c] = antialias.apply(channels[:, c], record.step, periodic=record.periodic)
        return channels
