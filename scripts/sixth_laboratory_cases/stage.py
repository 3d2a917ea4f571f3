"""Case of a linear stage on air bearings, whose motor cogs: in closed loop, with its command held from sample to sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from fifth_laboratory_cases.stepping import stepper
from third_laboratory_cases.oscillator import inlined
from third_laboratory_cases.units import MILLIMETRE, of_joint

from bench.arrays import Array
from sixth_laboratory_cases.case import Case, Channel, Left, Parameter, Run, Session, Signals
from sixth_laboratory_cases.models import STAGE as STAGE_MODEL
from sixth_laboratory_cases.signals import levels, multisine, rate_of
from sixth_laboratory_cases.stepping import held


class Carriage(NamedTuple):
    """A carriage with the iron core of a linear motor; what follows its damping, a nominal model has not."""

    mass: float
    """Mass [kg]."""
    damping: float
    """Viscous damping of the rail [N s/m]."""
    cogging: float = 0.0
    """Amplitude of the force of the cogging [N]."""
    second: float = 0.0
    """Amplitude of its second harmonic [N]."""
    pitch: float = 0.03
    """Its period along the rail [m]."""
    phase: float = 0.0
    """Its phase at the origin [rad]."""
    lag: float = 2e-4
    """Time constant [s] of the drive."""
    cable: float = 0.0
    """Stiffness [N/m] of the cable."""


@inlined
def carriage_derivative(p: Carriage, s: Array, load: Array, t: float) -> tuple[float, float, float]:
    """Time derivative of position, velocity and force of the drive under a commanded force [N]."""
    x, v, force = s[0], s[1], s[2]
    angle = 2.0 * np.pi * x / p.pitch + p.phase
    cogging = p.cogging * np.sin(angle) + p.second * np.sin(2.0 * angle)
    return v, (force - p.damping * v - cogging - p.cable * x) / p.mass, (load[0] - force) / p.lag


carriage_march = stepper(carriage_derivative)


def carriage(run: Run) -> Signals:
    """A carriage whose commanded force is held."""
    motion = carriage_march(Carriage(**run.values), np.zeros(3), held(run.loads), run.step)
    return {
        "command": run.loads[:, 0],
        "position": motion.state[:, 0],
        "velocity": motion.state[:, 1],
        "force": motion.state[:, 2],
    }


class Controller(NamedTuple):
    """What the loop of the stage is set to.

    Attributes:
        mass: By which it feeds the acceleration forward [kg].
        stiffness: Force over error of the position [N/m].
        damping: Force over error of the velocity [N s/m].
        smoothing: Part of what is new in the velocity that it follows within a sample.
        noise: Standard deviation of the position that it reads [m].
    """

    mass: float = 3.2
    stiffness: float = 4500.0
    damping: float = 130.0
    smoothing: float = 0.4
    noise: float = 1e-6


def controlled(session: Session, target: Array) -> Array:
    """Force [N] that the controller asks for while the carriage follows a target [m], both at each step (n_steps + 1,)."""
    p, loop, substeps = Carriage(**session.values), Controller(), session.substeps
    step, rate, rows = 1.0 / session.clock.rate, session.clock.rate / substeps, target[::substeps]
    speed = rate_of(rows, rate)
    acceleration = rate_of(speed, rate)
    state, last, smooth, out = np.zeros(3), 0.0, 0.0, np.zeros(target.size)
    for i in range(rows.size):
        seen = state[0] + loop.noise * session.rng.standard_normal()
        smooth += loop.smoothing * ((seen - last) * rate - smooth) if i else 0.0
        last = seen
        force = loop.mass * acceleration[i] + loop.stiffness * (rows[i] - seen)
        force += loop.damping * (speed[i] - smooth)
        out[i * substeps : (i + 1) * substeps] = force
        state = carriage_march(p, state, held(np.full((substeps + 1, 1), force)), step).state[-1]
    return out


def followed(session: Session) -> Sequence[Array]:
    """Forces [N] of the controller along a slow multisine, moves from point to point, and two multisines at once."""
    clock, rng = session.clock, session.rng
    slow = multisine(clock, rng, (0.1, 1.6), 0.014)
    moves = levels(clock, (0.03, -0.02, 0.045, 0.01, -0.04, 0.0), 0.7)
    mixed = multisine(clock, rng, (0.1, 0.4), 0.018) + multisine(clock, rng, (1.0, 3.0), 0.004)
    return [controlled(session, target) for target in (slow, moves, mixed)]


STAGE = Case(
    name="sixth_stage_1",
    number=6,
    rig="stage.xml",
    model=STAGE_MODEL,
    rate=500,
    seconds=18.0,
    substeps=10,
    simulate=carriage,
    excitation=followed,
    parameters={
        "mass": Parameter("mass:carriage", 3.2, 0.03, "kg"),
        "damping": Parameter("damping:rail", 14.0, 1.5, "N s/m"),
    },
    missing={"cogging": 1.0, "pitch": 0.03, "phase": 0.9},
    besides={"second": 0.03, "lag": 4e-4, "cable": 1.5},
    channels={
        "force_command": Channel("command", "N", told={"role": "command", "actuator": "motor"}),
        "position": Channel(
            "position", "mm", 0.0015, MILLIMETRE, resolution=0.001, told=of_joint("rail", "position")
        ),
    },
    responses=("position",),
    told={"load_interpolation": "zero_order_hold", "window_s": 0.5},
    right=[["cogging"]],
    also=["actuator_lag", "actuator_delay"],
    why="cogging of 1 N along 30 mm",
    tested="a linear stage on air bearings in closed loop; the command, which is held, and the scale",
    size="26 to 73 % of the command (73 % in the record from point to point, which mostly stands)",
    background="second harmonic 3 % of the cogging, lag of the drive 0.4 ms, cable of 1.5 N/m, scale in steps of 1 um",
    noise_stated="as it is",
    left={"position": Left(35.61, 1.70, 31.94, 1.89, 0.01)},
    farthest="mass +27.3",
    found="1.2; 0.9733 N, phase 0.9014",
)
