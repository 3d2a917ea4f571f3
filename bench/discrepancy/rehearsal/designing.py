"""Signals for a case: of shapes that a rig can do, scaled to its limits, those whose records would tell most.

The shapes are those of the next test (`next_test.feasible_excitations`), on an arm one a joint, apart in frequency. Each is played on the
nominal model, scaled down until commands and responses keep their limits, and weighed by the information of its record: for every
uncertain parameter the logarithm of prior over posterior width, for every effect at the size that matters ``log(1 + chi2 / c) / 2`` with c
the chi-squared from which it can be named. The second record is the one that adds most to the first; the judging one is of another shape.

References:
    M. Gevers, Identification for control, European Journal of Control 11, 2005 (experiments for what is to be told).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.arrays import Array
from bench.discrepancy.application.applying import specification
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.case.reading import GROUPS, read_case
from bench.discrepancy.case.schema import NominalDocument
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.model_units import declared_units, in_model_units
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.next_test.feasible_excitations import RigLimits, candidates, shapes
from bench.discrepancy.precheck.information import Told, effects_told, parameters_told
from bench.discrepancy.precheck.joint_information import joints_told
from bench.discrepancy.precheck.joints import admitted_joints
from bench.discrepancy.precheck.settings import CheckSettings
from bench.discrepancy.rehearsal.designed import NAMES, Designed, Tried
from bench.discrepancy.rehearsal.placing import SETTINGS as PLACING
from bench.discrepancy.rehearsal.truth import ModelLaboratory
from bench.discrepancy.settings import DEFAULT
from bench.errors import BenchError, ParameterError, SimulationError
from bench.rig.actuators import commanded
from bench.signals import Multisine


@dataclass(frozen=True)
class DesigningSettings:
    """Numbers of `bench.discrepancy.rehearsal.designing`."""

    ramp: float = 0.5
    """Seconds in which a signal rises from rest."""
    centres: tuple[float, ...] = (0.3, 1.0)
    """Frequencies about which joints of an arm are moved [Hz]: slow, where gravity and friction rule, and quick, where inertia does."""
    periods: float = 4.0
    """Periods of these frequencies that a record holds at least."""
    apart: float = 0.17
    """Part by which the frequency of each further joint lies above the one before, so that no two move alike."""


SETTINGS = DesigningSettings()


def design_signals(
    folder: Path,
    *,
    seconds: float = 20.0,
    rate: float = 0.0,
    effects: Sequence[str] = (),
    seed: int = 0,
    progress: Callable[[str, float], None] = lambda text, share: None,
) -> Designed:
    """Design the signals for a case.

    Args:
        folder: nominal.json, the MJCF, records if there are any.
        seconds: Length of each signal [s].
        rate: Sample rate [Hz]; zero for that of nominal.json or of the records.
        effects: Names of effects that they are to tell, of one each of the families where empty.
        seed: Of phases and noise.
        progress: Called with what is being done and the share that is.

    Raises:
        ParameterError: Nothing states the sample rate or the limit of a command, or no signal keeps the limits.
        ModelError: The rig is no MJCF.
    """
    declared = read_case(folder, planned=True)
    units, (known, _) = declared_units(declared), in_model_units(declared)
    step = 1.0 / _rate(folder, known, rate)
    samples = round(seconds / step)
    if samples < 1000:
        raise ParameterError(
            f"{seconds:g} s at {1 / step:g} Hz are {samples} samples; give at least 1000, with --seconds or --rate"
        )
    blank = _blank(known, samples, step)
    laboratory = ModelLaboratory.of(blank)
    limits = _limits(known, laboratory)
    names = [text.partition(":")[0] for text in effects]
    wanted = names or list(PLACING.articulated if laboratory.articulated else PLACING.linear)
    shapes_of = _of_joints if laboratory.articulated else _of_structure
    found = shapes_of(laboratory, limits, samples, step, seed)
    tried: list[Tried] = []
    for k, (label, columns) in enumerate(found):
        progress(label, k / (len(found) + 1))
        kept = _within(laboratory, label, columns, limits)
        if kept is not None:
            told = _information(laboratory, (kept.record,), wanted, seed)
            tried.append(replace(kept, information=told))
    tried.sort(key=lambda one: -one.information)
    if len(tried) < len(NAMES):
        raise ParameterError(
            f'{len(tried)} signals of {len(found)} keep the limits; {len(NAMES)} are needed: check "limits" in nominal.json'
        )
    progress("which go together", len(found) / (len(found) + 1))
    first, rest = tried[0], tried[1 : 1 + DEFAULT.next_test.finalists]
    second = max(rest, key=lambda one: _information(laboratory, (first.record, one.record), wanted, seed))
    judge = next(one for one in tried[1:] if one is not second)
    inputs = {c.name: units[c.name] for c in known.channels if c.role != "response"}
    shown = tuple(one.shown_in(units) for one in tried)
    return Designed(shown, (first.label, second.label, judge.label), inputs)


def _rate(folder: Path, case: Case, asked: float) -> float:
    stated = asked or NominalDocument.read(folder / "nominal.json").sample_rate_hz or 0.0
    if not stated and case.identification:
        stated = 1.0 / case.identification[0].step
    if not stated > 0.0:
        raise ParameterError(
            'nothing states the sample rate; give --rate, or "sample_rate_hz" in nominal.json'
        )
    return float(stated)


def _blank(case: Case, samples: int, step: float) -> Case:
    """The case with one record of either group that holds nothing."""
    values = {channel.name: np.zeros(samples) for channel in case.channels}
    records = {group: (CaseRecord(group, step, 0.0, values),) for group in GROUPS}
    return replace(case, identification=records["identification"], validation=records["validation"])


def _limits(case: Case, laboratory: ModelLaboratory) -> RigLimits:
    """What commands and responses may reach: as stated, as the model limits them, as earlier records bore it."""
    stated: Any = case.options.get("limits", {})
    records = (*case.identification, *case.validation)
    own = _of_model(laboratory)
    load, motion = {}, {}
    for channel in case.channels:
        shown = max((float(np.abs(r.values[channel.name]).max()) for r in records), default=0.0)
        if channel.role == "response":
            borne = DEFAULT.next_test.reach * shown if shown else math.inf
            motion[channel.name] = float(
                stated.get(channel.name, min(borne, own.get(channel.name, math.inf)))
            )
            continue
        most = float(stated.get(channel.name, shown or own.get(channel.name, 0.0)))
        if most <= 0.0:
            raise ParameterError(
                f'nothing limits \'{channel.name}\'; give "limits": {{"{channel.name}": LARGEST}} in nominal.json'
            )
        load[channel.name] = most
    return RigLimits(load, motion)


def _of_model(laboratory: ModelLaboratory) -> dict[str, float]:
    """RigLimits that the model itself has: ranges of joints and of controls, by channel."""
    compiled = specification(laboratory.path).compile()
    try:
        case = bound(laboratory.case, compiled)
    except BenchError:  # of a linear structure channels may stand for more than joints
        return {}
    out = {}
    for channel in case.channels:
        kind, _, name = channel.target.partition(":")
        if kind == "joint" and channel.quantity == "position":
            i = compiled.joint(name).id
            if compiled.jnt_limited[i]:
                out[channel.name] = float(np.abs(compiled.jnt_range[i]).min())
        elif kind == "actuator":
            u = compiled.actuator(name).id
            if compiled.actuator_ctrllimited[u]:
                out[channel.name] = float(np.abs(compiled.actuator_ctrlrange[u]).min())
            elif commanded(compiled, u) == "position" and compiled.jnt_limited[compiled.actuator_trnid[u, 0]]:
                out[channel.name] = float(np.abs(compiled.jnt_range[compiled.actuator_trnid[u, 0]]).min())
    return out


def _ramped(columns: Array, step: float) -> Array:
    rise = np.minimum(np.arange(len(columns)) * step / SETTINGS.ramp, 1.0)
    return columns * rise[:, None]


def _of_structure(
    laboratory: ModelLaboratory, limits: RigLimits, samples: int, step: float, seed: int
) -> list[tuple[str, dict[str, Array]]]:
    """Shapes around the resonances of a linear structure."""
    rng = np.random.default_rng(seed)
    # the motion of the nominal model says where it moves most when nothing resonates
    wave = Multisine(band=(2.0 / (samples * step), 0.1 / step), phases="schroeder").sample(
        samples, 1.0 / step, rng
    )
    loads = {name: 0.1 * most * wave / np.abs(wave).max() for name, most in limits.load.items()}
    moved = laboratory.played(loads)
    problem = Problem(moved, structure_of(moved), moved.identification)
    levels = DEFAULT.next_test.levels
    out = []
    for label, columns in candidates(problem, range(len(problem.structure.loads)), samples):
        ramped = _ramped(columns, step)
        for level in levels:
            shown = label if level == 1.0 else f"{label}, at {100 * level:.0f} %"
            named = {
                name: level * limits.load[name] * ramped[:, j] for j, name in enumerate(problem.structure.loads)
            }  # fmt: skip
            out.append((shown, {name: named.get(name, np.zeros(samples)) for name in limits.load}))
    return out


def _of_joints(
    laboratory: ModelLaboratory, limits: RigLimits, samples: int, step: float, seed: int
) -> list[tuple[str, dict[str, Array]]]:
    """Shapes in all joints of an arm at once, apart in frequency."""
    compiled = specification(laboratory.path).compile()
    case, model = bound(laboratory.case, compiled), ArticulatedModel.of(compiled)
    inputs = [input_of(case, joint).name for joint in model.joints]
    out = []
    slowest = SETTINGS.periods / (samples * step)
    for centre in sorted({max(centre, slowest) for centre in SETTINGS.centres}):
        lists = [shapes(centre * (1.0 + SETTINGS.apart * j), samples * step) for j in range(len(inputs))]
        for entries in zip(*lists, strict=True):
            columns = {}
            for j, (name, (_, signal)) in enumerate(zip(inputs, entries, strict=True)):
                x = signal.sample(samples, 1.0 / step, np.random.default_rng((seed, j)))
                shape = _ramped(np.asarray(x)[:, None], step)[:, 0]
                columns[name] = limits.load[name] * shape / max(float(np.abs(shape).max()), 1e-300)
            label = entries[0][0].replace("at the resonance, ", "at ")
            out.append((f"{label}, all joints" if len(inputs) > 1 else label, columns))
    return out


def _within(
    laboratory: ModelLaboratory, label: str, commands: dict[str, Array], limits: RigLimits
) -> Tried | None:
    """A signal scaled down until the responses of the nominal model keep their limits; None where it cannot be."""
    scale, settings = 1.0, DEFAULT.next_test
    for _ in range(settings.scalings):
        scaled = {name: scale * samples for name, samples in commands.items()}
        try:
            record = laboratory.played(scaled).identification[0]
        except SimulationError:
            scale *= 0.5
            continue
        peaks = {name: float(np.abs(record.values[name]).max()) for name in limits.motion}
        ratio = max((peaks[name] / most for name, most in limits.motion.items()), default=0.0)
        if ratio <= 1.0:
            largest = {name: float(np.abs(samples).max()) for name, samples in scaled.items()}
            return Tried(label, math.nan, largest, peaks, record)
        scale *= float(np.clip(settings.margin / ratio, 0.2, settings.margin))
    return None


def _information(
    laboratory: ModelLaboratory, records: Sequence[CaseRecord], wanted: Sequence[str], seed: int
) -> float:
    """What records would tell of the parameters and of some effects [nat]."""
    settings, rng = CheckSettings(), np.random.default_rng(seed)
    noisy = tuple(laboratory.logged(record, rng) for record in records)
    case = replace(laboratory.case, identification=noisy, validation=noisy[:1])
    if laboratory.articulated:
        own, model, _ = admitted_joints(case)
        if own is None or model is None:
            return -math.inf
        parameters, effects = joints_told(own, model, settings, only=wanted)
    else:
        problem = Problem(case, structure_of(case), case.identification)
        parameters, columns = parameters_told(problem, settings)
        effects = effects_told(case, problem, columns, settings, only=wanted)
    return _nats(parameters, effects, settings)


def _nats(parameters: Sequence[Told], effects: Sequence[Told], settings: CheckSettings) -> float:
    known = sum(-math.log(max(one.figure, 1e-12)) for one in parameters)
    return known + sum(0.5 * math.log1p(one.figure**2 / settings.certain) for one in effects)
