"""Records run in plain MuJoCo: controls along straight lines, actuators' memories as the record left them, many windows at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from bench import native
from bench.arrays import Array
from bench.discrepancy.application.applying import Applied
from bench.discrepancy.application.writing import hook_text
from bench.discrepancy.case.acquisition import at_times
from bench.discrepancy.case.case import CaseRecord

Hook = Callable[[mujoco.MjModel, mujoco.MjData], None]


class RunMotion(NamedTuple):
    """A run: positions (n, nq) and velocities (n, nv) at its samples, and accelerations (n, nv)."""

    position: Array
    velocity: Array
    acceleration: Array


class Reading(NamedTuple):
    """A judged coordinate of a record: measured and simulated (n,), what its error is held against, and from which sample on."""

    measured: Array
    simulated: Array
    size: float
    first: int = 0

    @property
    def error(self) -> Array:
        """Simulated less measured over the size, as judged."""
        return (self.simulated - self.measured)[self.first :] / self.size


def hook_of(applied: Applied) -> Hook | None:
    """The very function that the snippet holds, compiled; None where there is none."""
    text = hook_text(applied)
    if not text:
        return None
    space: dict[str, Any] = {}
    exec(f"import math\nimport mujoco\nimport numpy as np\n{text}", space)
    return space["before_step"]


def controls(
    record: CaseRecord, columns: dict[str, Array], model: mujoco.MjModel, steps: int, interpolation: str
) -> Array:
    """Controls (steps, nu) of the actuators in `columns`, in the middle of every step; zero for the others."""
    step = float(model.opt.timestep)
    middles = np.arange(0.5, steps) * (step / record.step)
    out = np.zeros((steps, model.nu))
    for name, samples in columns.items():
        out[:, model.actuator(name).id] = at_times(samples, middles, interpolation)
    return out


class Stretch(NamedTuple):
    """A stretch of a record: its first step, and position (nq,) and velocity (nv,) there."""

    first: int
    position: Array
    velocity: Array


class Train(NamedTuple):
    """A train between a motor and its link: indices of its deflection's position and velocity, and of those of the motor, where the
    encoder is on the link and shows their sum; None where it is on the motor. `joint` is the motor's name."""

    address: int
    dof: int
    motor: tuple[int, int] | None
    joint: str = ""

    def wind(self, position: Array, velocity: Array, deflection: float, rate: float) -> None:
        """Wind it up as far in positions (nq,) and velocities (nv,), which are written to; what its encoder shows stays."""
        if self.motor is not None:
            position[self.motor[0]] += position[self.address] - deflection
            velocity[self.motor[1]] += velocity[self.dof] - rate
        position[self.address], velocity[self.dof] = deflection, rate


def run(
    model: mujoco.MjModel,
    hook: Hook | None,
    windows: list[Stretch],
    control: Array,
    steps: int,
    *,
    rested: bool,
    trains: Sequence[Train] = (),
) -> tuple[Array, Array]:
    """Run windows of `steps` steps; return positions (n_windows, steps + 1, nq) and velocities (n_windows, steps + 1, nv).

    What no encoder shows, the memory of laws and the deflection of trains, a window takes over from the end of the one before.

    Args:
        model: The model.
        hook: Called before every step.
        windows: Where they start, in order.
        control: Controls (all_steps, nu) of the whole record; its last row is held.
        steps: Steps a window.
        rested: Whether actuators had no input before the record; otherwise its first.
        trains: Trains whose deflection is taken over.
    """
    own = mujoco.MjModel.__copy__(model)
    own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    known, activations = _filters(own), _activations(own, control, rested=rested)
    laws = np.setdiff1d(np.arange(own.na), [int(own.actuator_actadr[u]) for u in known])
    whole: list[Array] = []

    def start(k: int) -> Array:
        data, window = mujoco.MjData(own), windows[k]
        data.qpos[:], data.qvel[:] = window.position, window.velocity
        data.act[:] = activations[min(window.first, len(activations) - 1)]
        if k > 0 and hidden and np.isfinite(end := whole[k - 1][window.first - windows[k - 1].first]).all():
            _take_over(own, data, end, laws, trains)
        _remember(own, data, control, window.first, rested=rested)
        return _state(own, data)

    def runs(starts: list[Array], rows: list[Array]) -> Array:
        if hook is None:
            found, _ = rollout.rollout(own, mujoco.MjData(own), np.array(starts), np.array(rows))
            states = np.asarray(found, dtype=np.float64)
        else:
            states = np.array([_stepped(own, hook, s, c) for s, c in zip(starts, rows, strict=True)])
        return np.concatenate([np.array(starts)[:, None, :], states], axis=1)

    hidden = bool(len(laws) or trains)
    rows = [control[np.minimum(w.first + np.arange(steps), len(control) - 1)] for w in windows]
    with native.running(own):
        if hidden:
            for k, row in enumerate(rows):
                whole.append(runs([start(k)], [row])[0])
        else:
            whole = list(runs([start(k) for k in range(len(windows))], rows))
    out = np.array(whole)
    return out[:, :, 1 : 1 + own.nq], out[:, :, 1 + own.nq : 1 + own.nq + own.nv]


def _state(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    return state


def _take_over(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    end: Array,
    laws: NDArray[np.int64],
    trains: Sequence[Train],
) -> None:
    """Set what no encoder shows to what it is in another state; what encoders show stays."""
    other = mujoco.MjData(model)
    mujoco.mj_setState(model, other, end, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    data.act[laws] = other.act[laws]
    for train in trains:
        train.wind(data.qpos, data.qvel, other.qpos[train.address], other.qvel[train.dof])


def _stepped(model: mujoco.MjModel, hook: Hook, start: Array, control: Array) -> Array:
    data, spec = mujoco.MjData(model), mujoco.mjtState.mjSTATE_FULLPHYSICS
    mujoco.mj_setState(model, data, start, spec)
    out = np.empty((len(control), len(start)))
    for k, row in enumerate(control):
        data.ctrl[:] = row
        hook(model, data)
        mujoco.mj_step(model, data)
        mujoco.mj_getState(model, data, out[k], spec)
    return out


def _filters(model: mujoco.MjModel) -> list[int]:
    """Actuators whose activation is a first-order filter of their control."""
    known = {int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT)}
    return [u for u in range(model.nu) if int(model.actuator_dyntype[u]) in known]


def _activations(model: mujoco.MjModel, control: Array, *, rested: bool) -> Array:
    """What first-order filters hold before every step (n, na); other activations begin at zero."""
    out = np.zeros((len(control), model.na))
    step = float(model.opt.timestep)
    for u in _filters(model):
        at, share = (
            int(model.actuator_actadr[u]),
            1.0 - np.exp(-step / max(float(model.actuator_dynprm[u, 0]), 1e-12)),
        )
        late = round(float(model.actuator_delay[u]) / step)
        held = 0.0 if rested else control[0, u]
        seen = np.concatenate([np.full(late, held), control[:, u]])
        value = held
        for k in range(len(control)):
            out[k, at] = value
            value += share * (seen[k] - value)
    return out


def _remember(
    model: mujoco.MjModel, data: mujoco.MjData, control: Array, first: int, *, rested: bool
) -> None:
    """Fill the buffers of delayed actuators with the controls before a step."""
    step = float(model.opt.timestep)
    for u in range(model.nu):
        n = int(model.actuator_history[u, 0])
        if n < 1:
            continue
        before = first - n + np.arange(n)
        values = np.where(before >= 0, control[np.maximum(before, 0), u], 0.0 if rested else control[0, u])
        times = (np.arange(n) - n) * step
        mujoco.mj_initCtrlHistory(model, data, u, times.reshape(-1, 1), np.ascontiguousarray(values))


def coordinate_at(position: Array, velocity: Array, step: float, times: Array) -> Array:
    """A coordinate of a run (n,) at sample times: between two of its steps, the cubic that has its positions and velocities there."""
    at = times / step
    k = np.clip(np.floor(at + 1e-6).astype(int), 0, len(position) - 2)
    s = at - k
    begins = (1.0 + 2.0 * s) * position[k] + s * step * velocity[k]
    ends = (3.0 - 2.0 * s) * position[k + 1] - (1.0 - s) * step * velocity[k + 1]
    return np.asarray((1.0 - s) ** 2 * begins + s**2 * ends)


def sampled(position: Array, velocity: Array, model: mujoco.MjModel, times: Array) -> RunMotion:
    """A run of one window at sample times, of its own steps where these are no whole number of them."""
    step = float(model.opt.timestep)
    clock = np.arange(len(position)) * step
    if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
        nan = np.full((len(times), velocity.shape[1]), np.nan)
        return RunMotion(nan, nan, nan)
    at = times / step
    if np.allclose(at, np.round(at), atol=1e-6):
        index = np.round(at).astype(int)
        q, v = position[index], velocity[index]
    else:
        q, v = CubicSpline(clock, position)(times), CubicSpline(clock, velocity)(times)
    if int(model.opt.integrator) == int(mujoco.mjtIntegrator.mjINT_RK4):
        a = np.asarray(CubicSpline(clock, velocity).derivative()(times))
    else:  # the step's own: constant over it
        rates = np.diff(velocity, axis=0) / step
        a = rates[np.minimum(np.floor(at + 1e-6).astype(int), len(rates) - 1)]
    return RunMotion(q, v, a)
