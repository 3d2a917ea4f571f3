"""Running rigs: drives to controls, native batches over threads, and records of what happened."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from mujoco.batch import Batch
from mujoco.batch import SimulationError as BatchError
from numpy.typing import NDArray

from bench import native
from bench.errors import ModelError, ParameterError, RangeWarning, SimulationError
from bench.laws.along import force_along
from bench.provenance import provenance
from bench.recording import Recording
from bench.rig.building import PlacedElement
from bench.rig.description import Rig
from bench.rig.drives import Drive, controls_of, whole_steps
from bench.rig.element import Element

STATE = (
    mujoco.mjtState.mjSTATE_TIME
    | mujoco.mjtState.mjSTATE_QPOS
    | mujoco.mjtState.mjSTATE_QVEL
    | mujoco.mjtState.mjSTATE_ACT
)


def simulate(
    rig: Rig,
    drive: Drive,
    *,
    rng: np.random.Generator | None = None,
    initial: Mapping[str, tuple[float, float]] | None = None,
    sample_rate: float | None = None,
    settle: float = 0.0,
) -> Recording:
    """Run one simulation and return its record.

    Args:
        rig: The rig.
        drive: What drives the actuators; it sets the duration.
        rng: Source of randomness of an excitation.
        initial: (position, velocity) by joint at the start; at rest where not given.
        sample_rate: Rate of the record [Hz], a divisor of the step rate; every step by default.
        settle: Seconds at the start of the record that scores leave out.

    Returns:
        The record, with the channels `rig.channels`.

    Raises:
        SimulationError: The simulation diverged; names time, element and last good state.
    """
    return simulate_batch(
        [rig], [drive], rngs=[rng], initial=initial, sample_rate=sample_rate, settle=settle, threads=1
    )[0]


def simulate_batch(
    rigs: Sequence[Rig],
    drives: Sequence[Drive],
    *,
    rngs: Sequence[np.random.Generator | None] | None = None,
    initial: Mapping[str, tuple[float, float]] | None = None,
    sample_rate: float | None = None,
    settle: float = 0.0,
    threads: int | None = None,
) -> list[Recording]:
    """Run many simulations over threads; results do not depend on the number of threads, to the last bit.

    Args:
        rigs: Rigs of the same layout (the same MJCF and laws; parameters and structure may differ).
        drives: One drive a rig, of the same duration; a single drive serves all.
        rngs: One generator a rig.
        initial: As for `simulate`.
        sample_rate: As for `simulate`.
        settle: As for `simulate`.
        threads: Number of threads; all cores by default.

    Returns:
        One record a rig.

    Raises:
        ModelError: The rigs have different layouts.
        SimulationError: A simulation diverged; names the rig, time, element and last good state.
    """
    if len(drives) == 1:
        drives = list(drives) * len(rigs)
    if rngs is None:
        rngs = [None] * len(rigs)
    if not len(rigs) == len(drives) == len(rngs):
        raise ParameterError(
            f"{len(rigs)} rigs, {len(drives)} drives and {len(rngs)} generators came; one each is expected"
        )
    stride = _stride(rigs[0], sample_rate)
    states, sensors, controls = _roll(rigs, drives, rngs, initial, threads)
    return [
        _record(rig, states[i], sensors[i], controls[i], stride=stride, settle=settle)
        for i, rig in enumerate(rigs)
    ]


def _stride(rig: Rig, sample_rate: float | None) -> int:
    if sample_rate is None:
        return 1
    stride = whole_steps(sample_rate, rig)
    if stride < 1:
        raise ParameterError(
            f"a record of {sample_rate:g} Hz does not divide the {1.0 / rig.timestep:g} steps a second of the rig"
        )
    return stride


def _roll(
    rigs: Sequence[Rig],
    drives: Sequence[Drive],
    rngs: Sequence[np.random.Generator | None],
    initial: Mapping[str, tuple[float, float]] | None,
    threads: int | None,
) -> tuple[NDArray, NDArray, NDArray]:
    """States ``(n_rigs, n, 1 + nq + nv + na)``, sensors and controls at the start of each step."""
    first = rigs[0].model
    controls = np.stack(
        [controls_of(rig, drive, rng) for rig, drive, rng in zip(rigs, drives, rngs, strict=True)]
    )
    batch = Batch(first, len(rigs), threads or os.cpu_count() or 1)
    if len(rigs) > 1:
        try:
            batch.set_models([rig.model for rig in rigs])
        except ValueError as error:
            raise ModelError(f"rigs of one batch must share their MJCF and laws: {error}") from error
    _set_initial(batch, rigs, initial)
    n, n_own = controls.shape[1], controls.shape[2]
    padded = np.zeros((len(rigs), n, first.nu))
    padded[:, :, :n_own] = controls  # the state actuators come after the rig's own and take no command
    start = np.concatenate(
        [np.zeros((len(rigs), 1)), batch.bind("qpos"), batch.bind("qvel"), batch.bind("act")], axis=1
    )
    with native.running(*{id(rig.model): rig.model for rig in rigs}.values()):
        try:
            result = batch.rollout(n, padded, mujoco.mjtState.mjSTATE_CTRL, [STATE, "sensordata"])
        except BatchError as error:
            place = int(error.ids[0])
            raise SimulationError(
                f"MuJoCo gave up on the simulation of rig '{rigs[place].name}': {batch.error(place)}. Simplify the model (contacts "
                "take most memory), or give it more with <size memory=…>",
                time=float("nan"),
            ) from error
    states = np.concatenate([start[:, None, :], result[STATE]], axis=1)
    for i, rig in enumerate(rigs):
        _check_finite(rig, states[i], controls[i])
    return states[:, :-1], result["sensordata"], controls


def _set_initial(
    batch: Batch, rigs: Sequence[Rig], initial: Mapping[str, tuple[float, float]] | None
) -> None:
    for joint, state in (initial or {}).items():
        try:
            position, velocity = map(float, state)
        except (TypeError, ValueError):
            position = velocity = float("nan")
        if not (np.isfinite(position) and np.isfinite(velocity)):
            raise ParameterError(
                f"the initial state of joint '{joint}' is {state!r}; a finite position and velocity are expected, as (0.01, 0.0)"
            )
        (at_q, at_v, _), *more = native.coordinate(rigs[0].model, joint).terms
        if more:
            raise ModelError(f"'{joint}' is a tendon; give the initial position and velocity of its joints")
        batch.bind("qpos")[:, at_q] = position
        batch.bind("qvel")[:, at_v] = velocity
    for i, rig in enumerate(rigs):
        for item in rig.built.placed:
            if item.act >= 0:
                batch.bind("act")[i, item.act : item.act + len(item.element.law.states)] = (
                    item.element.law.start()
                )


def _check_finite(rig: Rig, states: NDArray, controls: NDArray) -> None:
    """Raise a `SimulationError` where the clock stopped (MuJoCo found a bad state) or a number is not finite."""
    stopped = np.diff(states[:, 0], prepend=-np.inf) <= 0.0
    bad = stopped | ~np.isfinite(states).all(axis=1)
    if not bad.any():
        return
    last = int(np.argmax(bad)) - 1
    model, state = rig.model, states[last]
    qpos, qvel = state[1 : 1 + model.nq], state[1 + model.nq : 1 + model.nq + model.nv]
    forces = {}
    for item in rig.built.placed:
        if item.theta >= 0:
            _, _, force, _ = _along(
                item, states[last : last + 1], controls[min(last, len(controls) - 1) :][:1], model
            )
            forces[item.element.name] = float(np.max(np.abs(np.nan_to_num(force, nan=np.inf))))
    worst = max(forces, key=lambda name: forces[name]) if forces else None
    cause = f"; the largest element force there is that of '{worst}', {forces[worst]:.3g}" if worst else ""
    joints = [model.joint(int(model.dof_jntid[i])).name for i in range(min(model.nv, 8))]
    place = ", ".join(
        f"{joint} = {q:.4g} (v = {v:.4g})" for joint, q, v in zip(joints, qpos, qvel, strict=False)
    )
    raise SimulationError(
        f"the simulation of rig '{rig.name}' diverged after t = {state[0]:.6g} s; last good state: {place}{cause}. "
        f"Try a smaller timestep (now {rig.timestep:g} s), or check that element's parameters and the excitation's level.",
        time=float(state[0]),
        element=worst,
    )


def _along(
    item: PlacedElement, states: NDArray, controls: NDArray, model: mujoco.MjModel
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Displacement, velocity, force ``(n, n_coordinates)`` and hidden states ``(n, n_states)`` of an element."""
    nq, nv = model.nq, model.nv
    qpos, qvel, act = states[:, 1 : 1 + nq], states[:, 1 + nq : 1 + nq + nv], states[:, 1 + nq + nv :]
    pairs = [coordinate.values(qpos, qvel, controls) for coordinate in item.coordinates]
    q = np.stack([pair[0] for pair in pairs], axis=1)
    v = np.stack([pair[1] for pair in pairs], axis=1)
    z = act[:, item.act : item.act + len(item.element.law.states)] if item.act >= 0 else act[:, :0]
    return q, v, force_along(item.element.law, item.element.theta, states[:, 0], q, v, z), z


def _record(
    rig: Rig, states: NDArray, sensors: NDArray, controls: NDArray, *, stride: int, settle: float
) -> Recording:
    states, sensors, controls = states[::stride], sensors[::stride], controls[::stride]
    columns = [controls, sensors]
    for item in rig.built.placed:
        moving = len(item.element.joints)
        q, v, force, z = _along(item, states, controls, rig.model)
        columns += [q[:, :moving], v[:, :moving], force[:, :moving], z]
        _warn_outside(rig, item.element, np.concatenate([q[:, :moving], v[:, :moving]], axis=1))
    values = np.concatenate(columns, axis=1)
    time = np.arange(len(states), dtype=np.float64) * (stride * rig.timestep)
    meta = provenance(
        rig=rig.name,
        timestep=rig.timestep,
        integrator=rig.integrator,
        elements=[e.to_dict() for e in rig.elements],
    )
    return Recording(time, values, rig.channels, settle=settle, meta=meta)


def _warn_outside(rig: Rig, element: Element, states: NDArray) -> None:
    if element.validity is None:
        return
    outside = element.validity.outside(states)
    if outside.any():
        at = int(np.argmax(outside))
        warnings.warn(
            f"rig '{rig.name}': the reduced-order joint '{element.name}' was used outside the range it was identified on "
            f"in {100.0 * outside.mean():.2g} % of the samples (first at sample {at}); its forces there are extrapolated. "
            "Identify it on records that reach this range.",
            RangeWarning,
            stacklevel=4,
        )
