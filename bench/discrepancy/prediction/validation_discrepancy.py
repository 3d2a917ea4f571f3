"""How far the discrepancy shrinks: free runs of the judging records before, in between and after.

The discrepancy is rms(simulated - measured) / std(measured) of a position-like channel over whole judging records, simulated
from rest with the measured loads and nothing else. On the joint it is that of the relative motion of each axis.
Records that start in motion, and windows of records that would drift, begin at the state estimated from the record itself
(`fitting.initial_state_fit`), every model's from the same samples; the metric says so.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from bench.discrepancy.case.case import Case, CaseRecord, Prediction
from bench.discrepancy.fitting.initial_state_fit import predict as predicted
from bench.discrepancy.fitting.initial_state_fit import run_kind
from bench.discrepancy.likelihood.noise_covariance import forces_of_noise
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.settings import DEFAULT, JudgementSettings
from bench.discrepancy.verdict import Gap

DIVERGED_GAP = 1e3
"""Gap that stands for a simulation that diverged."""


def coordinates(
    structure: Structure, besides: Collection[str] = ()
) -> list[tuple[str, tuple[tuple[str, float], ...]]]:
    """Return the judged coordinates: name, and the channels with their signs.

    A place whose relative coordinate is the difference of two measured positions is judged by that difference;
    otherwise every channel of the lowest measured order is judged on its own.

    Args:
        structure: Of the rig.
        besides: Channels that are judged on their own besides.
    """
    lowest = min((o.order for o in structure.observers), default=0)
    judged: list[tuple[str, tuple[tuple[str, float], ...]]] = []
    singles = {
        int(np.flatnonzero(o.row)[0]): o.channel
        for o in structure.observers
        if o.order == lowest and np.count_nonzero(o.row) == 1
    }
    for place in structure.places:
        if len(place.rows) != 1:
            continue
        active = np.flatnonzero(place.rows[0])
        if all(int(i) in singles for i in active):
            judged.append((place.name, tuple((singles[int(i)], float(place.rows[0, i])) for i in active)))
    judged = judged or [(o.channel, ((o.channel, 1.0),)) for o in structure.observers]
    known = {channels[0][0] for _, channels in judged if len(channels) == 1}
    return judged + [(name, ((name, 1.0),)) for name in sorted(set(besides) - known)]


def nrmse(measured: Array, simulated: Array) -> float:
    """rms(simulated - measured) / std(measured); `DIVERGED_GAP` where the simulation is not finite."""
    if not np.isfinite(simulated).all():
        return DIVERGED_GAP
    return float(
        min(np.sqrt(np.mean((simulated - measured) ** 2)) / max(np.std(measured), 1e-300), DIVERGED_GAP)
    )


def gaps(
    case: Case,
    problem: Problem,
    *,
    stages: Sequence[tuple[str, Prediction]],
    rng: np.random.Generator,
    final: tuple[Hypothesis, Array] | None = None,
) -> tuple[Gap, ...]:
    """Gap of every judged coordinate over the validation records.

    Args:
        case: The case.
        problem: Its problem on all degrees of freedom, for the noise.
        stages: (label, prediction) in order: nominal model, parameters only, after each effect, final.
        rng: For the bootstrap.
        final: Effects and vector behind the last stage, which the noise of a prescribed motion passes; the nominal model where
            None.
    """
    predictions = [[predict(record) for record in case.validation] for _, predict in stages]
    out = []
    for name, channels in coordinates(problem.structure):
        measured = [_combine(record.values, channels) for record in case.validation]
        simulated = [[_combine(p, channels) for p in stage] for stage in predictions]
        whole = np.concatenate(measured)
        values = [nrmse(whole, np.concatenate(stage)) for stage in simulated]
        floor = noise_level(problem, channels, case.validation, final) / max(float(np.std(whole)), 1e-300)
        settings = problem.settings.judgement
        interval = _bootstrap(
            measured,
            (simulated[0], simulated[-1]),
            floor * float(np.std(whole)),
            rng,
            lambda *levels, settings=settings: closed_share(*levels, settings=settings),
            settings=settings,
        )
        out.append(
            Gap(
                metric=f"validation {_label(channels)} NRMSE, {run_kind(problem, case.validation)}",
                before=values[0],
                parameters_only=values[1],
                after=values[-1],
                noise_floor=floor,
                closed=closed_share(values[0], values[-1], floor, settings=settings),
                closed_ci95=interval,
                steps=tuple((label, value) for (label, _), value in zip(stages, values, strict=True)),
                dof=name,
            )
        )
    return tuple(out)


def errors_by_block(
    problem: Problem,
    records: Sequence[CaseRecord],
    predict: Prediction,
    blocks: int,
    besides: Collection[str] = (),
) -> Array:
    """Squared error (n_coordinates, n_records * blocks) of a prediction: what every block of some records adds to the square of the NRMSE.

    Args:
        problem: Problem on all degrees of freedom.
        records: What is predicted.
        predict: The prediction.
        blocks: Blocks of each record.
        besides: As of `coordinates`.
    """
    runs = [predict(record) for record in records]
    out = []
    for _, channels in coordinates(problem.structure, besides):
        measured = [_combine(record.values, channels) for record in records]
        errors = [_combine(run, channels) - own for run, own in zip(runs, measured, strict=True)]
        whole = np.concatenate(measured)
        power = max(float(np.sum((whole - whole.mean()) ** 2)), 1e-300)
        parts = [block for error in errors for block in np.array_split(error, blocks)]
        out.append([float(np.sum(part**2)) / power for part in parts])
    table = np.array(out)
    return np.where(np.isfinite(table), table, DIVERGED_GAP**2)


def noise_floors(problem: Problem, records: Sequence[CaseRecord], besides: Collection[str] = ()) -> Array:
    """NRMSE (n_coordinates,) that noise alone leaves of every judged coordinate of some records, see `coordinates`."""
    found = []
    for _, channels in coordinates(problem.structure, besides):
        whole = np.concatenate([_combine(record.values, channels) for record in records])
        found.append(noise_level(problem, channels, records) / max(float(np.std(whole)), 1e-300))
    return np.array(found)


def closed_share(
    before: float, after: float, floor: float, *, settings: JudgementSettings = DEFAULT.judgement
) -> float:
    """``(before - after) / (before - floor)``; one where there was nothing to close."""
    if before <= settings.at_the_noise * floor:
        return 1.0
    return (before - after) / (before - floor)


class ClosedPart(NamedTuple):
    """What a part of an explanation closes of the judging records.

    Attributes:
        share: Of the whole discrepancy.
        ci95: Its block-bootstrap interval.
        size: NRMSE that comes back without it.
    """

    share: float
    ci95: tuple[float, float]
    size: float


def part_closed(
    case: Case,
    problem: Problem,
    nothing: Prediction,
    rest: Prediction,
    best: Prediction,
    rng: np.random.Generator,
) -> ClosedPart:
    """What lies between two predictions, as a part of the discrepancy of the nominal model; on the coordinate where it is largest.

    Args:
        case: The case.
        problem: Its problem on all degrees of freedom, for the noise.
        nothing: The nominal model, its parameters re-estimated.
        rest: An explanation without one of its effects, the others fitted again.
        best: The explanation.
        rng: For the bootstrap.
    """
    settings, found = problem.settings.judgement, []
    runs = [[predict(record) for record in case.validation] for predict in (nothing, rest, best)]

    def share(whole: float, without: float, left: float, floor: float) -> float:
        return min(closed_share(whole, whole - without + left, floor, settings=settings), 1.0)

    for _, channels in coordinates(problem.structure):
        measured = [_combine(record.values, channels) for record in case.validation]
        simulated = [[_combine(run, channels) for run in own] for own in runs]
        together = np.concatenate(measured)
        whole, without, left = (nrmse(together, np.concatenate(own)) for own in simulated)
        noise = noise_level(problem, channels, case.validation)
        value = share(whole, without, left, noise / max(float(np.std(together)), 1e-300))
        interval = _bootstrap(measured, simulated, noise, rng, share, settings=settings)
        found.append(ClosedPart(value, interval, without - left))
    return max(found, key=lambda part: part.size)


def noise_level(
    problem: Problem,
    channels: Sequence[tuple[str, float]],
    records: Sequence[CaseRecord],
    final: tuple[Hypothesis, Array] | None = None,
) -> float:
    """RMS that the noise of the channels, and of the measured loads passed through the structure, leaves [channel unit].

    Args:
        problem: Problem on all degrees of freedom.
        channels: Names and signs of the channels that make the judged coordinate.
        records: Judging records.
        final: Effects and vector of a model of a component whose motion is prescribed: what the noise of the motion makes of its
            force.
    """
    index = [problem.structure.channels.index(name) for name, _ in channels]
    signs = np.array([sign for _, sign in channels])
    own = float(np.sum(signs**2 * problem.noise[index] ** 2))
    record = records[0]
    if problem.driven:
        return float(np.sqrt(own + _forces_of_noise(problem, records, final or ((), _nominal(problem)))))
    load_noise = problem.load_noise_of(record)
    if not np.any(load_noise):
        return float(np.sqrt(own))
    if problem.windowed:
        windows = problem.prepare(record).windows
        assert windows is not None
        return float(np.sqrt(signs @ windows.floor[np.ix_(index, index)] @ signs))
    omega = np.asarray(2.0 * np.pi * np.fft.rfftfreq(len(record), record.step)[1:], dtype=np.float64)
    response = problem.structure.transfer(problem.structure.at(problem.nominal), omega)[:, index]
    combined = np.abs(np.einsum("fcu,c->fu", response, signs)) ** 2 @ load_noise**2
    return float(np.sqrt(own + np.mean(combined)))


def _nominal(problem: Problem) -> Array:
    return np.zeros(len(problem.nominal))


def _forces_of_noise(
    problem: Problem, records: Sequence[CaseRecord], model: tuple[Hypothesis, Array]
) -> float:
    """Mean square of the force that the noise of a prescribed motion makes in a component.

    Friction makes most of it: the noise decides at which sample a reversal falls.
    """
    forces = [forces_of_noise(problem, record, model) for record in records]
    return float(np.mean([float(np.mean(force**2)) for force in forces]))


def _label(channels: Sequence[tuple[str, float]]) -> str:
    if len(channels) == 1:
        return channels[0][0]
    return "relative " + channels[0][0].rsplit("_", 1)[0]


def _combine(values: Mapping[str, Array], channels: Sequence[tuple[str, float]]) -> Array:
    total = np.zeros(len(values[channels[0][0]]))
    for name, sign in channels:
        total = total + sign * values[name]
    return total


def _bootstrap(
    measured: Sequence[Array],
    runs: Sequence[Sequence[Array]],
    noise: float,
    rng: np.random.Generator,
    share: Callable[..., float],
    *,
    settings: JudgementSettings,
) -> tuple[float, float]:
    """95 % interval of a share of the NRMSE of several runs and that of noise alone, blocks of the judging records drawn with replacement.

    Args:
        measured: By record.
        runs: By run and record.
        noise: RMS that noise alone leaves.
        rng: For the draws.
        share: NRMSE of every run, and of the noise, to the share.
        settings: `JudgementSettings` of the diagnosis.
    """
    if not all(np.isfinite(own).all() for run in runs for own in run):
        return (0.0, 1.0)
    rows = []
    for m, *found in zip(measured, *runs, strict=True):
        centred = m - m.mean()
        for block in np.array_split(np.arange(len(m)), settings.blocks):
            errors = [np.sum((own - m)[block] ** 2) for own in found]
            rows.append([*errors, noise**2 * len(block), np.sum(centred[block] ** 2)])
    table = np.array(rows)
    draws = table[rng.integers(len(table), size=(1000, len(table)))].sum(axis=1)
    levels = np.sqrt(draws[:, :-1] / np.maximum(draws[:, -1:], 1e-300))
    low, high = np.percentile([share(*own) for own in levels], [2.5, 97.5])
    return float(low), float(high)


def nominal_prediction(problem: Problem) -> Prediction:
    """Prediction of the untouched nominal model, for `gaps`."""

    def predict(record: CaseRecord) -> Mapping[str, Array]:
        samples = predicted(problem, (), _nominal(problem), record)
        return {name: samples[:, c] for c, name in enumerate(problem.structure.channels)}

    return predict
