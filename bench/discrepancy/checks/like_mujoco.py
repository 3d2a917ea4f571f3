"""Whether the nominal simulation of a diagnosis is the user's MJCF as MuJoCo runs it.

The diagnosis reads matrices, dry friction and gravity off a model. Whatever else a model may hold (limits, tendons, contacts, fluids,
sensors that clip, and what MuJoCo learns next) is not read item by item: the model is run in MuJoCo with the loads of the records,
its nominal values in place, and both simulations are held against each other. Where they part by more than MuJoCo's own error of
integration and by enough to be taken for an effect, the item that makes the difference is looked for by taking items out of the model.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco import rollout

from bench import native
from bench.arrays import Array
from bench.discrepancy.case.acquisition import at_times
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.checks.reference import MujocoReference
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.settings import LikenessSettings


class Deviation(NamedTuple):
    """How far the two simulations part on a channel: over its noise, over the response, and at which time it first shows [s]."""

    record: str
    channel: str
    noise: float
    share: float
    time: float


def _limits_of_joints(model: mujoco.MjModel) -> None:
    model.jnt_limited[:] = 0


def _limits_of_tendons(model: mujoco.MjModel) -> None:
    model.tendon_limited[:] = 0


def _limits_of_forces(model: mujoco.MjModel) -> None:
    model.actuator_forcelimited[:] = 0
    model.jnt_actfrclimited[:] = 0
    model.tendon_actfrclimited[:] = 0


def _limits_of_commands(model: mujoco.MjModel) -> None:
    model.actuator_ctrllimited[:] = 0


def _contacts(model: mujoco.MjModel) -> None:
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


def _friction(model: mujoco.MjModel) -> None:
    model.dof_frictionloss[:] = 0.0
    model.tendon_frictionloss[:] = 0.0


def _equalities(model: mujoco.MjModel) -> None:
    model.eq_active0[:] = 0


def _fluid(model: mujoco.MjModel) -> None:
    model.opt.density = model.opt.viscosity = 0.0


def _cutoffs(model: mujoco.MjModel) -> None:
    model.sensor_cutoff[:] = 0.0


def _slack(model: mujoco.MjModel) -> None:
    model.tendon_lengthspring[:, 1] = model.tendon_lengthspring[:, 0]


ITEMS: dict[str, Callable[[mujoco.MjModel], None]] = {
    "the range of a joint": _limits_of_joints,
    "the range of a tendon": _limits_of_tendons,
    "forcerange or actuatorfrcrange": _limits_of_forces,
    "ctrlrange": _limits_of_commands,
    "a contact": _contacts,
    "frictionloss": _friction,
    "an equality": _equalities,
    "the fluid (density, viscosity)": _fluid,
    "the cutoff of a sensor": _cutoffs,
    "the slack of a tendon (springlength)": _slack,
}
"""What a model may hold beyond matrices, and how it is taken out."""


def unlike_mujoco(
    problem: Problem,
    reference: MujocoReference,
    records: Sequence[CaseRecord],
    settings: LikenessSettings | None = None,
) -> str:
    """What parts the nominal simulation from MuJoCo's, in words; empty where nothing does.

    Args:
        problem: The nominal model of the diagnosis.
        reference: The same as MuJoCo has it.
        records: Records whose loads are tried.
        settings: When they count as one.
    """
    chosen = settings or problem.settings.checks.likeness
    if problem.driven or reference.unsteady:
        return ""
    plain = copy.copy(problem)
    plain.windowed = False
    usable = [record for record in records if record.at_rest and not record.periodic]
    budget = chosen.steps
    found: Deviation | None = None
    worst: CaseRecord | None = None
    for record in usable:
        split = _split(reference, record.step)
        length = min(len(record), budget // split)
        if length < 2:
            break
        budget -= length * split
        for deviation in _deviations(plain, reference, reference.model, record, length, split, chosen):
            if found is None or deviation.noise > found.noise:
                found, worst = deviation, record
    if found is None or worst is None:
        return ""
    return _words(found, _culprit(plain, reference, worst, chosen))


def _deviations(
    problem: Problem, reference: MujocoReference, model: mujoco.MjModel, record: CaseRecord, length: int, split: int,
    settings: LikenessSettings,
) -> list[Deviation]:  # fmt: skip
    """Channels on which the simulations part."""
    own = problem.simulate((), np.zeros(len(problem.nominal)), record)[:length]
    between = problem.case.load_interpolation
    coarse = simulated(reference, model, record, length, split, between)
    fine = simulated(reference, model, record, length, 2 * split, between)
    largest = np.array([np.max(np.abs(record.values[name])) for name in reference.responses])
    beyond = np.any(np.abs(fine) > settings.reached * largest, axis=1)
    length = int(np.argmax(beyond)) if beyond.any() else length
    if length < 2:
        return []
    own, coarse, fine = own[:length], coarse[:length], fine[:length]
    out = []
    for c, name in enumerate(problem.structure.channels):
        if name not in reference.responses:
            continue
        at = list(reference.responses).index(name)
        if not np.isfinite([own[:, c], fine[:, at], coarse[:, at]]).all():
            continue
        difference = own[:, c] - fine[:, at]
        size = _rms(difference)
        allowed = settings.integration * _rms(fine[:, at] - coarse[:, at])
        level, response = float(problem.noise[c]), max(_rms(fine[:, at]), _rms(own[:, c]), 1e-300)
        if size > allowed and size > settings.noise * level and size > settings.share * response:
            first = int(np.argmax(np.abs(difference) > max(level, settings.share * response)))
            out.append(Deviation(record.name, name, size / level, size / response, float(record.time[first])))
    return out


def _split(reference: MujocoReference, step: float) -> int:
    """MuJoCo's steps a sample: its own step size, or that at which it is accurate, a time constant of the fastest motion."""
    longest = min(reference.model.opt.timestep, 1.0 / max(reference.fastest, 1e-9))
    return max(int(np.ceil(step / longest - 1e-9)), 1)


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


@native.quiet()
def simulated(
    reference: MujocoReference,
    model: mujoco.MjModel,
    record: CaseRecord,
    length: int,
    split: int,
    interpolation: str = "linear",
) -> Array:
    """Responses (length, n_responses) of a model in MuJoCo, counted from rest, under the loads of a record.

    Args:
        reference: Where loads and responses are.
        model: The model, or a variant of it.
        record: For the loads.
        length: Samples.
        split: MuJoCo's steps a sample.
        interpolation: How loads ran between their samples, as of `Case.load_interpolation`.
    """
    variant = copy.copy(model)
    variant.opt.timestep = record.step / split
    at = (
        np.arange(length * split) / split + 0.5 / split
    )  # the middle of each step: held loads are else late by half of one
    control = np.tile(reference.control, (len(at), 1))
    for channel, (index, factor) in reference.loads.items():
        control[:, index] += factor * at_times(record.values[channel], at, interpolation)
    data = mujoco.MjData(variant)
    data.qpos[:] = reference.rest
    size = mujoco.mj_stateSize(variant, int(mujoco.mjtState.mjSTATE_FULLPHYSICS))
    start = np.zeros(size)
    mujoco.mj_getState(variant, data, start, int(mujoco.mjtState.mjSTATE_FULLPHYSICS))
    with rollout.Rollout(nthread=0) as runner:
        _, sensors = runner.rollout([variant], [data], start[None, :], control[None])
    readings = np.asarray(sensors, dtype=np.float64)[0, ::split]
    return np.asarray(readings[:, list(reference.responses.values())] - reference.offsets, dtype=np.float64)


def _culprit(
    problem: Problem, reference: MujocoReference, record: CaseRecord, settings: LikenessSettings
) -> str:
    """The item without which MuJoCo comes nearest to the nominal simulation; empty where none helps."""
    split = _split(reference, record.step)
    length = min(len(record), settings.steps // split)
    own = problem.simulate((), np.zeros(len(problem.nominal)), record)[:length]
    columns = [problem.structure.channels.index(name) for name in reference.responses]

    def distance(model: mujoco.MjModel) -> float:
        found = simulated(reference, model, record, length, split, problem.case.load_interpolation)
        difference = found - own[:, columns]
        return float(np.sum((difference / problem.noise[columns]) ** 2))

    whole = distance(reference.model)
    left: Mapping[str, float] = {
        name: distance(_without(reference.model, take)) for name, take in ITEMS.items()
    }
    best = min(left, key=lambda name: left[name])
    if left[best] < 0.5 * whole:
        return best
    soft = max(left[name] for name in ("frictionloss", "an equality")) > whole
    return (
        "the softness of its constraints (solref and solimp of an equality or of frictionloss)"
        if soft
        else ""
    )


def _without(model: mujoco.MjModel, take: Callable[[mujoco.MjModel], None]) -> mujoco.MjModel:
    variant = copy.copy(model)
    take(variant)
    return variant


def _words(found: Deviation, culprit: str) -> str:
    what = culprit or "something in the model that its mass, damping and stiffness matrices do not hold"
    return (
        f"run in MuJoCo with the loads of '{found.record}', your model gives '{found.channel}' {100 * found.share:.3g} % "
        f"({found.noise:.3g} times the noise) away from the nominal model that a diagnosis can work with, from t = {found.time:.4g} s on: "
        f"{what} comes into play; take it out of the model and let the diagnosis look for it, or stay where it does not act"
    )
