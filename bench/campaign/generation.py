"""From a plan to the tables of one part: draws, native batches, measurement.

Records of one rig with the same elements run as one native batch, each with its own row of parameters; nothing is
compiled for a record. A record that fails (a parameter outside the bounds of its law, a diverging simulation) is set
aside with its reason, and the others of the part are what they would have been without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch
from mujoco.batch import SimulationError as BatchError
from numpy.typing import NDArray

from bench import native
from bench.campaign.drawing import RecordDraw, check_design, draws, median_draw, record_streams
from bench.campaign.plan import Plan
from bench.campaign.variant import Rows, Variant, Variants, chains_of, drawn_commands, kept_channels
from bench.errors import BenchError, ParameterError, SimulationError, UnknownNameError
from bench.measurement import measure
from bench.recording import Recording
from bench.rig import simulate
from bench.rig.drives import controls_of
from bench.rig.simulation import STATE
from bench.signals.streams import named_streams


class Failure(NamedTuple):
    """Why a record was set aside.

    Attributes:
        record: Number of the record.
        reason: The message.
        time: Time of the last good state [s]; NaN where nothing was simulated.
    """

    record: int
    reason: str
    time: float


class Part(NamedTuple):
    """The records of one part.

    Attributes:
        draws: What every record drew, the failed ones included.
        good: Records that did not fail.
        values: ``(n_channels, n_good, n_samples)``.
        has: Whether a record has a channel ``(n_channels, n_good)``.
        failures: The others.
    """

    draws: list[RecordDraw]
    good: list[int]
    values: NDArray
    has: NDArray[np.bool_]
    failures: list[Failure]


@dataclass(frozen=True)
class _Ready:
    """A record that is ready to run: its place in the part, theta by element controls ``(n, n_actuators)``, start."""

    draw: RecordDraw
    place: int
    thetas: list[NDArray[np.float64]]
    controls: NDArray[np.float64]
    start: Mapping[str, tuple[float, float]]


class Generator:
    """Generates the parts of a plan; safe to share between threads.

    Args:
        plan: The plan.

    Attributes:
        channels: The channels of the data set.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.variants = Variants(plan)
        self.channels = kept_channels(plan, self.variants)

    def check(self) -> None:
        """Find mistakes of the plan before anything runs: every rig with its excitations and sensors, at the medians.

        Raises:
            BenchError: What a record would fail with, whatever it draws.
        """
        check_design(self.plan)
        for rig in range(len(self.plan.rigs)):
            variant = self.variants.full(rig)
            if _stride(variant, self.plan) < 1:
                raise ParameterError(
                    f"{self.plan.sample_rate:g} Hz does not divide the {1.0 / variant.rig.timestep:g} steps a second "
                    f"of rig '{variant.plan.name}'; set its timestep"
                )
            for excitation in self.plan.fitting(self.plan.excitations, rig):
                for sensors in self.plan.fitting(self.plan.sensors, rig) or [-1]:
                    draw = median_draw(self.plan, rig, excitation, sensors)
                    ready = self._prepared(variant, draw, 0)
                    if isinstance(ready, Failure):
                        raise ParameterError(f"rig '{variant.plan.name}': {ready.reason}")
                    for channel in chains_of(self.plan, draw):
                        if channel not in variant.sources:
                            raise UnknownNameError(
                                f"channel of rig '{variant.plan.name}' (sensors '{self.plan.sensors[sensors].name}')",
                                channel,
                                variant.sources,
                            )

    def part(self, index: int, *, threads: int = 1) -> Part:
        """Generate a part.

        Args:
            index: Number of the part.
            threads: Threads of its native batches; the numbers do not depend on it.
        """
        records = self.plan.part(index)
        drawn = draws(self.plan, records)
        values = np.empty((len(self.channels), len(records), self.plan.n_samples), dtype=self.plan.precision)
        has = np.zeros((len(self.channels), len(records)), dtype=bool)
        failures: list[Failure] = []
        groups: dict[tuple[int, tuple[bool, ...]], list[tuple[int, RecordDraw]]] = {}
        for place, draw in enumerate(drawn):
            groups.setdefault((draw.rig, draw.present), []).append((place, draw))
        for (rig, present), members in groups.items():
            failures += self._run(self.variants.of(rig, present), members, values, has, threads)
        failures.sort()
        bad = {failure.record for failure in failures}
        places = [place for place, draw in enumerate(drawn) if draw.record not in bad]
        if bad:
            values, has = values[:, places], has[:, places]
        return Part(drawn, [drawn[place].record for place in places], values, has, failures)

    def rebuild(self, record: int) -> Recording:
        """One record by itself, as `bench.rig.simulate` and `bench.measurement.measure` give it, with all channels.

        Raises:
            SimulationError: It diverges.
            BenchError: It cannot be set up.
        """
        draw = draws(self.plan, [record])[0]
        variant = self.variants.of(draw.rig, draw.present)
        _, excitation, sensors = record_streams(self.plan, record)
        drive, start = drawn_commands(self.plan, variant, draw, excitation)
        rig = variant.with_values(draw.values)
        recording = simulate(rig, drive, initial=start, sample_rate=self.plan.sample_rate)
        return measure(recording, chains_of(self.plan, draw), sensors)

    def _prepared(self, variant: Variant, draw: RecordDraw, place: int) -> _Ready | Failure:
        try:
            thetas = variant.thetas(draw.values)
            variant.check_structure(draw.values)
            drive, start = drawn_commands(self.plan, variant, draw, record_streams(self.plan, draw.record)[1])
            controls = controls_of(variant.rig, drive)
            chains_of(self.plan, draw)
        except (BenchError, ArithmeticError, ValueError) as error:  # whatever one record's numbers lead to
            return Failure(draw.record, str(error), float("nan"))
        return _Ready(draw, place, thetas, controls, start)

    def _run(
        self,
        variant: Variant,
        members: Sequence[tuple[int, RecordDraw]],
        values: NDArray,
        has: NDArray[np.bool_],
        threads: int,
    ) -> list[Failure]:
        """Run the records of one variant and write their channels in place; return the failures."""
        prepared = [self._prepared(variant, draw, place) for place, draw in members]
        failures = [item for item in prepared if isinstance(item, Failure)]
        ready = [item for item in prepared if isinstance(item, _Ready)]
        rows, whole = None, np.empty(0)
        while rows is None and ready:
            try:
                rows, whole = self._roll(variant, ready, threads)
            except BatchError as error:  # MuJoCo gave up on some; the others run again without them
                lost = {int(index) for index in error.ids}
                failures += [self._explained(ready[index].draw.record) for index in sorted(lost)]
                ready = [item for index, item in enumerate(ready) if index not in lost]
        if rows is None:
            return failures
        for index, item in enumerate(ready):
            fine = bool(whole[index]) and self._measured(variant, index, item, rows, values, has)
            if not fine:
                failures.append(self._explained(item.draw.record))
        return failures

    def _roll(
        self, variant: Variant, ready: Sequence[_Ready], threads: int
    ) -> tuple[Rows, NDArray[np.bool_]]:
        model = variant.rig.model
        steps = len(ready[0].controls)
        # the state actuators come last and take no command
        controls = np.zeros((len(ready), steps, model.nu))
        for index, item in enumerate(ready):
            controls[index, :, : item.controls.shape[1]] = item.controls
        batch = Batch(model, len(ready), threads)
        variant.fill(
            batch,
            [item.thetas for item in ready],
            [item.draw for item in ready],
            [item.start for item in ready],
        )
        inside = any(variant.sources[c.name].item >= 0 for c in self.channels if c.name in variant.sources)
        start = np.concatenate(
            [batch.bind("time")[:, None], batch.bind("qpos"), batch.bind("qvel"), batch.bind("act")], axis=1
        )
        record: list = ["sensordata", *([STATE] if inside else [])]
        with native.running(model):
            result = batch.rollout(steps, controls, mujoco.mjtState.mjSTATE_CTRL, record)
        # a simulation in which MuJoCo found a bad state stops, and its clock with it
        whole = np.abs(batch.bind("time") - steps * variant.rig.timestep) < 0.5 * variant.rig.timestep
        states = np.empty((len(ready), 0, 0))
        if inside:
            states = np.concatenate([start[:, None], result[STATE][:, :-1]], axis=1)
        return Rows(controls, result["sensordata"], states, _stride(variant, self.plan)), whole

    def _measured(
        self, variant: Variant, index: int, item: _Ready, rows: Rows, values: NDArray, has: NDArray[np.bool_]
    ) -> bool:
        chains = chains_of(self.plan, item.draw)
        streams = named_streams(record_streams(self.plan, item.draw.record)[2], chains) if chains else {}
        for place, channel in enumerate(self.channels):
            if channel.name not in variant.sources:
                continue
            column = variant.channel(channel.name, index, rows, item.thetas)
            if channel.name in chains:
                try:
                    column = chains[channel.name].apply(column, self.plan.sample_rate, streams[channel.name])
                except BenchError:  # found again, and told, by `_explained`
                    return False
            # the sum of finite numbers of any size a rig can reach is finite; of one NaN or inf it is not
            if not np.isfinite(column.sum()):
                return False
            values[place, item.place] = column
            has[place, item.place] = True
        return True

    def _explained(self, record: int) -> Failure:
        """Run a failed record by itself for the message with time, element and last good state."""
        try:
            self.rebuild(record)
        except SimulationError as error:
            return Failure(record, str(error), error.time)
        except (BenchError, RuntimeError) as error:
            return Failure(record, str(error), float("nan"))
        return Failure(record, "a channel is not finite after measurement", float("nan"))


def _stride(variant: Variant, plan: Plan) -> int:
    """Steps a sample; 0 where the record's rate does not divide the step rate."""
    stride = round(1.0 / (plan.sample_rate * variant.rig.timestep))
    return stride if abs(stride * plan.sample_rate * variant.rig.timestep - 1.0) <= 1e-6 else 0
