"""Judging records of a linear case run in the user's own model, in the metric of its verdict."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from scipy.optimize import least_squares

from bench.arrays import Array
from bench.discrepancy.application.applying import Applied, loads_of, rest_of
from bench.discrepancy.application.drives import LOGGED
from bench.discrepancy.application.forces import values_of
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.prediction.validation_discrepancy import DIVERGED_GAP, coordinates
from bench.discrepancy.replay.running import Reading, Stretch, controls, hook_of, run, sampled
from bench.discrepancy.response.initial_states import in_motion
from bench.discrepancy.response.windows import cut, drifts
from bench.discrepancy.verdict import NamedEffect


@dataclass(frozen=True)
class LinearReplaySettings:
    """Numbers of `bench.discrepancy.replay.linear_replay`."""

    periods: int = 8
    """Periods over which a steady state runs in from rest."""


SETTINGS = LinearReplaySettings()


@dataclass(frozen=True, eq=False)
class LinearReplay:
    """The judging records of a case.

    Attributes:
        case: The case.
        structure: Its nominal structure, which says how channels read the motion.
        windowed: Whether free runs drift and are cut into windows.
    """

    case: Case
    structure: Structure
    windowed: bool

    @classmethod
    def of(cls, case: Case, structure: Structure) -> LinearReplay:
        """Prepare the replay of a case."""
        table = {p.name: p.value for p in case.parameters}
        values = np.array([table[name] for name in structure.parameters])
        duration = max(len(record) * record.step for record in case.validation)
        return cls(case, structure, drifts(structure, structure.at(values), duration))

    def readings(self, applied: Applied, effects: Sequence[NamedEffect]) -> dict[str, list[Reading]]:
        """Every judged coordinate of every judging record, measured and simulated.

        Args:
            applied: The model they are run with.
            effects: What is wrong with sensors is put onto their readings.
        """
        player = _Player.of(self, applied)
        records = self.case.validation
        runs = [_read(effects, player.channels(_driven(effects, record)), record) for record in records]
        out = {}
        for name, channels in coordinates(self.structure):
            measured = [_sum(record.values, channels) for record in records]
            size = max(float(np.std(np.concatenate(measured))), 1e-300)
            out[name] = [Reading(y, _sum(run, channels), size) for y, run in zip(measured, runs, strict=True)]
        return out

    def errors(
        self, applied: Applied, effects: Sequence[NamedEffect], only: Collection[str] = ()
    ) -> dict[str, Array]:
        """Simulated less measured over the standard deviation of the measured, by judged coordinate, all judging records in a row.

        Those of `only` alone where any are named.
        """
        out = {}
        for name, found in self.readings(applied, effects).items():
            if only and name not in only:
                continue
            error = np.concatenate([(r.simulated - r.measured) / r.size for r in found])
            out[name] = error if np.isfinite(error).all() else np.full(len(error), DIVERGED_GAP)
        return out

    def sensed(
        self, applied: Applied, effects: Sequence[NamedEffect], record: CaseRecord
    ) -> dict[str, Array]:
        """What the response channels read (n,) when a model plays a record's loads; of wrong sensors what they say."""
        driven = _driven(effects, record)
        return _read(effects, _Player.of(self, applied).channels(driven), record)


def _sum(values: Mapping[str, Array], channels: Sequence[tuple[str, float]]) -> Array:
    return np.sum([sign * np.asarray(values[name]) for name, sign in channels], axis=0)


def _read(
    effects: Sequence[NamedEffect], channels: Mapping[str, Array], record: CaseRecord
) -> dict[str, Array]:
    """Channels (n,) of a record with what is wrong with their sensors or their clock."""
    out = dict(channels)
    known = {entry.name: entry for entry in CATALOGUE}
    for effect in effects:
        entry = known.get(effect.name)
        if entry is None or entry.signal is None or not effect.name.startswith(LOGGED):
            continue
        if effect.channel in out:
            values = np.array(list(values_of(effect).values()))
            out[effect.channel] = entry.signal(out[effect.channel], values, record.step)
    return out


def _driven(effects: Sequence[NamedEffect], record: CaseRecord) -> CaseRecord:
    """A record whose loads are those that acted: what was logged by another clock is put onto that of the responses."""
    logged = {entry.name for entry in CATALOGUE if entry.logged}
    return replace(record, values=_read([e for e in effects if e.name in logged], record.values, record))


class _Player:
    """Runs records with one model."""

    @classmethod
    def of(cls, replay: LinearReplay, applied: Applied) -> _Player:
        tested = applied.as_tested(replay.case)
        return cls(replay, tested, tested.compiled())

    def __init__(self, replay: LinearReplay, applied: Applied, model: mujoco.MjModel) -> None:
        self.replay, self.model, self.hook = replay, model, hook_of(applied)
        bare = applied.spec.compile()
        rest = rest_of(bare)
        self.rest = np.array(model.qpos0)
        for name, position in rest.items():
            self.rest[model.joint(name).qposadr[0]] = position
        dofs = [model.joint(name) for name in replay.structure.dofs]
        self.qadr = np.array([int(joint.qposadr[0]) for joint in dofs])
        self.dadr = np.array([int(joint.dofadr[0]) for joint in dofs])
        self.links = [applied.outputs.get(name) for name in replay.structure.dofs]

    def channels(self, record: CaseRecord) -> dict[str, Array]:
        """Readings (n,) by response channel of a free run."""
        case, structure = self.replay.case, self.replay.structure
        loads = loads_of(case, self.model)
        columns = {}
        for name in structure.loads:
            actuator = loads[name]
            target = case.channel(name).target
            cell = target.startswith("sensor:") or (not target and actuator != name)
            gain = float(self.model.actuator(actuator).gainprm[0]) if cell else 1.0
            columns[actuator] = np.asarray(record.values[name]) / gain
        if record.periodic:
            return self._periodic(record, columns)
        firsts, _ = (
            cut(case, record, len(structure.observers))
            if self.replay.windowed
            else (np.zeros(1, dtype=np.int64), len(record))
        )
        steps = int(np.ceil((len(record) - 1) * record.step / self.model.opt.timestep - 1e-9)) + 1
        control = controls(record, columns, self.model, steps, case.load_interpolation)
        rows = []
        for w, first in enumerate(firsts):
            end = len(record) if w == len(firsts) - 1 else int(firsts[w + 1])
            rows.append(self._window(record, control, int(first), end))
        return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}

    def _window(self, record: CaseRecord, control: Array, first: int, end: int) -> dict[str, Array]:
        """Readings between two samples, from rest or from the state that fits them best."""
        moving = self.replay.windowed or in_motion(record)
        n = len(self.qadr)
        if not moving:
            return self._free(record, control, first, end, np.zeros(2 * n))
        scale = {o.channel: self._noise(o.channel, record) for o in self.replay.structure.observers}
        guess = self._guess(record, first)
        spread = np.maximum(np.abs(guess), 1e-3 * max(float(np.max(np.abs(guess))), 1e-9))

        def residual(x: Array) -> Array:
            found = self._free(record, control, first, end, x * spread)
            parts = [(found[c] - record.values[c][first:end]) / s for c, s in scale.items()]
            return np.nan_to_num(
                np.concatenate(parts), nan=DIVERGED_GAP, posinf=DIVERGED_GAP, neginf=-DIVERGED_GAP
            )

        best = least_squares(residual, guess / spread, diff_step=1e-4, max_nfev=12).x
        return self._free(record, control, first, end, np.asarray(best) * spread)

    def _noise(self, channel: str, record: CaseRecord) -> float:
        stated = self.replay.case.channel(channel).noise_std
        return float(stated or 1e-2 * np.std(record.values[channel]) or 1.0)

    def _guess(self, record: CaseRecord, first: int) -> Array:
        n = len(self.qadr)
        out = np.zeros(2 * n)
        for observer in self.replay.structure.observers:
            i = int(np.argmax(np.abs(observer.row)))
            samples = np.asarray(record.values[observer.channel])
            if observer.order == 0:
                out[i] = samples[first] / observer.row[i]
                out[n + i] = np.gradient(samples, record.step)[first] / observer.row[i]
            elif observer.order == 1:
                out[n + i] = samples[first] / observer.row[i]
        return out

    def _free(
        self, record: CaseRecord, control: Array, first: int, end: int, state: Array
    ) -> dict[str, Array]:
        n, step = len(self.qadr), float(self.model.opt.timestep)
        q, v = self.rest.copy(), np.zeros(self.model.nv)
        q[self.qadr] += state[:n]
        v[self.dadr] += state[n:]
        begin = int(np.floor(first * record.step / step + 1e-6))
        steps = int(np.ceil((end - 1) * record.step / step - 1e-9)) - begin + 1
        position, velocity = run(
            self.model, self.hook, [Stretch(begin, q, v)], control, max(steps, 2), rested=first == 0
        )
        times = np.asarray(np.arange(first, end) * record.step - begin * step, dtype=np.float64)
        return self._observed(position[0], velocity[0], times)

    def _observed(self, position: Array, velocity: Array, times: Array) -> dict[str, Array]:
        motion = sampled(position, velocity, self.model, times)
        orders = (
            motion.position[:, self.qadr] - self.rest[self.qadr],
            motion.velocity[:, self.dadr],
            motion.acceleration[:, self.dadr],
        )
        return {o.channel: orders[o.order] @ o.row for o in self.replay.structure.observers}

    def _periodic(self, record: CaseRecord, columns: dict[str, Array]) -> dict[str, Array]:
        n, step = len(record), float(self.model.opt.timestep)
        steps = int(np.ceil(n * record.step / step - 1e-9))
        control = np.tile(
            controls(record, columns, self.model, steps, self.replay.case.load_interpolation),
            (SETTINGS.periods, 1),
        )
        start = [Stretch(0, self.rest, np.zeros(self.model.nv))]
        position, velocity = run(self.model, self.hook, start, control, len(control), rested=True)
        times = np.asarray(((SETTINGS.periods - 1) * n + np.arange(n)) * record.step, dtype=np.float64)
        return self._observed(position[0], velocity[0], times)
