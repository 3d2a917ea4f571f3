"""Machines into whose records faults are planted: a slide of the bench, the same as an own MJCF, an arm on servos."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np

from bench.rig import Element, simulate
from bench.rig.library import sdof_rig
from bench.signals import BandLimitedNoise, Excitation

Columns = dict[str, np.ndarray]
RATE, DURATION, ARM_RATE = 250.0, 12.0, 100.0


class Machine(NamedTuple):
    """What is measured, and which faults of its columns there can be.

    Attributes:
        measured: Records by name, nominal.json and the MJCF, if it has one, of a sound case.
        loads: Load channels.
        responses: Response channels.
        units: Channels and factors of other units.
        wrong: A load that is something else: its magnitude, or times a factor.
    """

    measured: Callable[[np.random.Generator], tuple[dict[str, Columns], dict, str]]
    loads: tuple[str, ...]
    responses: tuple[str, ...]
    units: tuple[tuple[str, float], ...]
    wrong: Callable[[np.ndarray, np.random.Generator], np.ndarray]


def measured(rng: np.random.Generator, peak: float = 30.0) -> tuple[dict[str, Columns], dict]:
    """Records by name and nominal.json of a sound case."""
    true: dict[str, Any] = {
        "mass": 2.0,
        "stiffness": rng.uniform(800.0, 3000.0),
        "damping": rng.uniform(3.0, 10.0),
    }
    std = {"mass": 0.02, "stiffness": 0.03, "damping": 0.2}
    hidden = [
        (),
        (),
        (Element.of("coulomb", "carriage", limit=0.08 * peak),),
        (Element.of("gap", "carriage", stiffness=0.5 * true["stiffness"], clearance=0.3 * peak / true["stiffness"]),),
    ]  # fmt: skip
    rig = sdof_rig(*hidden[int(rng.integers(len(hidden)))], **true, timestep=1e-3)
    drive = Excitation(
        {"shaker": BandLimitedNoise(cutoff=rng.uniform(6.0, 15.0), peak=peak)},
        duration=DURATION,
        sample_rate=1000.0,
    )
    records, noise = {}, {}
    for name in ("identification", "validation"):
        found = simulate(rig, drive, rng=np.random.default_rng(int(rng.integers(2**31))))
        take = slice(None, None, round(1000.0 / RATE))
        columns = {
            "time": np.array(found.time[take]),
            "force": np.array(found["shaker"][take]),
            "displacement": found["displacement"][take],
            "acceleration": found["acceleration_x"][take],
        }
        for channel in ("displacement", "acceleration"):
            noise.setdefault(channel, 0.005 * float(columns[channel].std()))
            columns[channel] = columns[channel] + noise[channel] * rng.standard_normal(len(columns[channel]))
        records[name] = columns
    nominal = {
        "rig": "sdof",
        "parameters": {
            name: {"value": value * (1.0 + std[name] * rng.standard_normal()), "std": std[name] * value}
            for name, value in true.items()
        },
        "channels": {
            "force": {"unit": "N", "role": "measured"},
            "displacement": {"unit": "m", "noise_std": noise["displacement"]},
            "acceleration": {"unit": "m/s^2", "noise_std": noise["acceleration"]},
        },
    }
    return records, nominal


MODEL = """<mujoco model="slide">
  <option timestep="0.001" integrator="RK4" gravity="0 0 0"/>
  <worldbody><body name="mass">
    <joint name="x" type="slide" axis="1 0 0" stiffness="{stiffness}" damping="{damping}"/>
    <inertial pos="0 0 0" mass="{mass}" diaginertia="0.01 0.01 0.01"/><site name="s"/>
  </body></worldbody>
  <actuator><motor name="force" joint="x"/></actuator>
  <sensor><jointpos name="displacement" joint="x"/><accelerometer name="acceleration" site="s"/></sensor>
</mujoco>"""
ARM = """<mujoco model="arm">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody><body name="upper">
    <joint name="shoulder" axis="0 1 0" damping="0.3" armature="0.02"/>
    <inertial pos="0 0 -0.12" mass="0.8" diaginertia="0.004 0.004 0.001"/>
    <body name="fore" pos="0 0 -0.25">
      <joint name="elbow" axis="0 1 0" damping="0.15" armature="0.01"/>
      <inertial pos="0 0 -0.1" mass="0.4" diaginertia="0.0015 0.0015 0.0004"/>
    </body></body></worldbody>
  <actuator><position name="m1" joint="shoulder" kp="30" kv="0.8"/><position name="m2" joint="elbow" kp="15" kv="0.4"/></actuator>
</mujoco>"""
JOINTS = ("shoulder", "elbow")


def slide(rng: np.random.Generator) -> tuple[dict[str, Columns], dict, str]:
    """The slide of the bench."""
    return *measured(rng), ""


def own_slide(rng: np.random.Generator) -> tuple[dict[str, Columns], dict, str]:
    """The slide as the user's own MJCF."""
    records, nominal = measured(rng)
    parameters = nominal["parameters"]
    names = {"mass": "mass:mass", "stiffness": "stiffness:x", "damping": "damping:x"}
    told = {"rig": "model.xml", "parameters": {names[n]: p for n, p in parameters.items()}}
    return records, nominal | told, MODEL.format(**{n: p["value"] for n, p in parameters.items()})


def arm(rng: np.random.Generator) -> tuple[dict[str, Columns], dict, str]:
    """An arm of two joints on servos, its numbers a little off, half of the time with friction or a delay at one of them."""
    model = mujoco.MjModel.from_xml_string(ARM)
    stated = {
        "mass": (model.body_mass[1:], 0.03, ("upper", "fore")), "damping": (model.dof_damping, 0.25, JOINTS),
        "armature": (model.dof_armature, 0.1, JOINTS), "kp": (model.actuator_gainprm[:, 0], 0.03, ("m1", "m2")),
    }  # fmt: skip
    parameters = {
        f"{kind}:{name}": {"value": float(value), "std": std * float(value)}
        for kind, (values, std, names) in stated.items()
        for name, value in zip(names, values, strict=True)
    }
    for values, std, _ in stated.values():
        np.multiply(values, 1.0 + std * np.clip(rng.standard_normal(2), -2.0, 2.0), out=values)
    model.actuator_biasprm[:, 1] = -model.actuator_gainprm[:, 0]
    hidden, at = int(rng.integers(4)), int(rng.integers(2))
    if hidden == 2:
        model.dof_frictionloss[at] = (0.3, 0.15)[at]
        model.dof_solref[at], model.dof_solimp[at, :3] = (0.002, 1.0), (0.99, 0.999, 1e-6)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    late = 2 if hidden == 3 else 0
    records, noise = {}, 1e-3
    n, every = round(DURATION * ARM_RATE), round(1.0 / (ARM_RATE * model.opt.timestep))
    for name in ("identification", "validation"):
        clock = np.arange(n) / ARM_RATE
        waves = [
            np.sin(2.0 * np.pi * np.outer(clock, rng.uniform(0.2, 1.5, 5)) + rng.uniform(0.0, 6.0, 5)).sum(
                axis=1
            )
            for _ in JOINTS
        ]
        target = np.column_stack([0.25 * (w - w[0]) * np.minimum(clock, 1.0) for w in waves])
        data, angles = mujoco.MjData(model), np.zeros((n, 2))
        for k in range(n):
            angles[k] = data.qpos
            data.ctrl[:] = target[max(k - late, 0)]
            mujoco.mj_step(model, data, nstep=every)
        angles += noise * rng.standard_normal(angles.shape)
        records[name] = {
            "time": clock,
            "t1": target[:, 0],
            "t2": target[:, 1],
            "q1": angles[:, 0],
            "q2": angles[:, 1],
        }
    channels: dict[str, Any] = {"time": {"unit": "s"}}
    for k, joint in enumerate(JOINTS, start=1):
        channels[f"t{k}"] = {"unit": "rad", "role": "command", "actuator": f"m{k}", "noise_std": 0.0}
        channels[f"q{k}"] = {"unit": "rad", "joint": joint, "quantity": "position", "noise_std": noise}
    nominal = {
        "rig": "model.xml",
        "load_interpolation": "zero_order_hold",
        "parameters": parameters,
        "channels": channels,
    }
    return records, nominal, ARM


def _not_a_force(load: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A magnitude, or a current before a gear."""
    return np.abs(load) if rng.random() < 0.5 else load / rng.uniform(12.0, 100.0)


def _not_an_angle(target: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A magnitude, or ticks of an encoder."""
    return np.abs(target) if rng.random() < 0.5 else target * 4096.0 / (2.0 * np.pi)


SLIDE_UNITS = (
    ("displacement", 1000.0),
    ("displacement", 39.37),
    ("acceleration", 1.0 / 9.80665),
    ("force", 0.001),
)
DEGREES = 180.0 / np.pi
MACHINES = {
    "slide": Machine(slide, ("force",), ("displacement", "acceleration"), SLIDE_UNITS, _not_a_force),
    "own slide": Machine(own_slide, ("force",), ("displacement", "acceleration"), SLIDE_UNITS, _not_a_force),
    "arm": Machine(
        arm, ("t1", "t2"), ("q1", "q2"), (("q1", DEGREES), ("q2", DEGREES), ("t1", DEGREES), ("t2", DEGREES)), _not_an_angle
    ),
}  # fmt: skip
