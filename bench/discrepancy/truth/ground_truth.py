"""What a rig with its withheld effects really does: the records of sealed cases before noise.

Smooth and continuous laws on the sdof and the joint rig are integrated by MuJoCo through the bench's native callback,
Runge-Kutta with `steps` steps a sample: the engine that users run. Set-valued friction and rigid stops, which MuJoCo's
callback can only round, go through Moreau's time stepping (`bench.discrepancy.truth.moreau_time_stepping`). A component under prescribed
motion needs no dynamics; its hidden states are integrated along the finely sampled motion. None of these is the integrator of
the fits. What they share with the fits are the kernels of the laws, which is the point of having them written once.

Between samples loads go in straight lines, as a test controller that interpolates plays them; nothing else is assumed
of the actuator unless it is the withheld effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import make_interp_spline

from bench.arrays import Array
from bench.discrepancy.truth.moreau_time_stepping import Acting, RigMatrices, Stop, TrueMotion, follow, march
from bench.discrepancy.truth.recipe import Drawn, Recipe


@dataclass(frozen=True)
class GroundTruthSettings:
    """Numbers of `bench.discrepancy.truth.ground_truth`."""

    steps: int = 20
    """Integration steps of MuJoCo a sample, and samples of a prescribed motion a sample of the record."""
    quick: Mapping[str, int] = field(default_factory=lambda: {"smooth": 4, "friction": 20})
    """Steps a sample of the time stepping while a strength is searched for: that needs a percent, not a record."""


GROUND_TRUTH_SETTINGS = GroundTruthSettings()
ROWS = {
    "sdof": {"": np.ones((1, 1))},
    "damper": {"": np.ones((1, 1))},
    "joint": {
        "axial": np.array([[-1.0, 1.0, 0.0, 0.0]]),
        "torsional": np.array([[0.0, 0.0, -1.0, 1.0]]),
        "joint": np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]]),
    },
}
"""Relative coordinates of the places of a rig."""
JOINTS = {
    "": ("carriage",), "axial": ("axial",), "torsional": ("torsional",), "joint": ("axial", "torsional"),
}  # fmt: skip
"""MuJoCo joint or tendons of a place."""


@dataclass(frozen=True)
class WithheldEffect:
    """A withheld effect at its place.

    Attributes:
        recipe: Which effect.
        where: Place; empty on rigs with one joint.
        drawn: Its numbers.
    """

    recipe: Recipe
    where: str
    drawn: Drawn


@dataclass(frozen=True)
class Truth:
    """A rig as it is.

    Attributes:
        rig: "sdof", "damper" or "joint".
        values: True parameters by their nominal names.
        rate: Sample rate [Hz].
    """

    rig: str
    values: Mapping[str, float]
    rate: float

    def matrices(self, effects: Sequence[WithheldEffect] = ()) -> RigMatrices:
        """The linear structure, wrong masses included."""
        value = dict(self.values)
        for e in effects:
            if e.recipe.site == "inertia":
                value[_mass_name(self.rig, e.where)] *= 1.0 + e.drawn.values["relative_error"]
            if e.drawn.carried:
                value[_mass_name(self.rig, e.where)] -= e.drawn.carried
        if self.rig != "joint":
            one = np.ones((1, 1))
            return RigMatrices(
                value.get("mass", 0.0) * one, value["damping"] * one, value["stiffness"] * one, one
            )
        blocks: dict[str, list[Array]] = {"mass": [], "damping": [], "stiffness": []}
        coupled = np.array([[1.0, -1.0], [-1.0, 1.0]])
        for axis, inertia in (("axial", "mass"), ("torsional", "inertia")):
            blocks["mass"].append(np.diag([value[f"{inertia}_1"], value[f"{inertia}_2"]]))
            for kind in ("damping", "stiffness"):
                mounts = np.diag([value[f"mount_{kind}_{axis}_{body}"] for body in (1, 2)])
                blocks[kind].append(mounts + value[f"joint_{kind}_{axis}"] * coupled)
        zero = np.zeros((2, 2))
        inputs = np.zeros((4, 2))
        inputs[0, 0] = inputs[2, 1] = 1.0
        return RigMatrices(*(np.block([[a, zero], [zero, b]]) for a, b in blocks.values()), inputs)  # pyrefly: ignore[bad-argument-count]


def _mass_name(rig: str, where: str) -> str:
    return {"axial": "mass_1", "torsional": "inertia_1"}[where] if rig == "joint" else "mass"


def motion_of(
    truth: Truth, effects: Sequence[WithheldEffect], loads: Array, *, quick: bool = False
) -> TrueMotion:
    """Motion from rest at the samples of the loads.

    Args:
        truth: The rig.
        effects: What is withheld.
        loads: (n, n_loads) commanded loads.
        quick: Coarse, for a search.

    Raises:
        SimulationError: MuJoCo's simulation diverged; the time stepping leaves NaN instead.
    """
    acting = [e for e in effects if e.recipe.site == "joint"]
    stop = next((e for e in effects if e.recipe.site == "stop"), None)
    rough = stop is not None or any(e.recipe.limit is not None for e in acting)
    step = 1.0 / truth.rate
    if not quick and not rough:
        return _in_mujoco(truth, effects, loads)
    fine, each = played(effects, loads, step)
    laws = [
        Acting(e.recipe.law, np.asarray(e.drawn.theta), ROWS[truth.rig][e.where], e.recipe.limit)
        for e in acting
        if e.recipe.law is not None
    ]
    barrier = None
    if stop is not None:
        v = stop.drawn.values
        barrier = Stop(ROWS[truth.rig][stop.where][0], v["position"], v["side"], v["restitution"])
    substeps = (
        GROUND_TRUTH_SETTINGS.quick["friction" if rough else "smooth"]
        if quick
        else 10 * GROUND_TRUTH_SETTINGS.steps
    )
    substeps = max(substeps // each, 2)
    motion = march(
        truth.matrices(effects), laws, loads=fine, step=step / each, substeps=substeps, stop=barrier
    )
    return TrueMotion(*(m[::each] for m in motion))


def played(effects: Sequence[WithheldEffect], loads: Array, step: float) -> tuple[Array, int]:
    """Loads that act, after what the actuator does to the commands, and their samples a sample of the record."""
    out = loads.copy()
    for e in effects:
        if e.recipe.site != "actuator":
            continue
        v = e.drawn.values
        if e.recipe.name == "force_gain_error":
            out = out * (1.0 + v["relative_error"])
        elif e.recipe.name == "actuator_saturation":
            out = np.clip(out, -v["level"], v["level"])
        elif e.recipe.name == "actuator_lag":
            # a digital drive that moves on once a sample by what an exponential does in that time
            share, state = -np.expm1(-step / v["time_constant"]), np.zeros(out.shape[1])
            for k, wanted in enumerate(out.copy()):
                state = state + share * (wanted - state)
                out[k] = state
    delays = [e.drawn.values["delay"] for e in effects if e.recipe.name == "actuator_delay"]
    if not delays:
        return out, 1
    clock = step * np.arange(len(out))
    late = step / GROUND_TRUTH_SETTINGS.steps * np.arange(len(out) * GROUND_TRUTH_SETTINGS.steps) - sum(
        delays
    )
    return np.column_stack(
        [np.interp(late, clock, column, left=0.0) for column in out.T]
    ), GROUND_TRUTH_SETTINGS.steps


def _in_mujoco(truth: Truth, effects: Sequence[WithheldEffect], loads: Array) -> TrueMotion:
    from bench.rig import Element, simulate  # noqa: PLC0415  (MuJoCo, which a diagnosis does not need)
    from bench.rig.library import joint_rig, sdof_rig  # noqa: PLC0415

    step = 1.0 / truth.rate
    elements = [
        Element(e.recipe.law, JOINTS[e.where], np.asarray(e.drawn.theta), name=f"effect_{i}")
        for i, e in enumerate(effects)
        if e.recipe.site == "joint" and e.recipe.law is not None
    ]
    matrices = truth.matrices(effects)
    fine, each = played(effects, loads, step)
    timestep = step / GROUND_TRUTH_SETTINGS.steps
    middle = timestep * (np.arange(len(loads) * GROUND_TRUTH_SETTINGS.steps) + 0.5)
    controls = [np.interp(middle, step / each * np.arange(len(fine)), column) for column in fine.T]
    if truth.rig == "sdof":
        rig = sdof_rig(
            *elements, mass=float(matrices.mass[0, 0]), stiffness=float(matrices.stiffness[0, 0]),
            damping=float(matrices.damping[0, 0]), timestep=timestep,
        )  # fmt: skip
        names, rates = ("displacement",), ("velocity",)
        drive: dict[str, Array] = {"shaker": controls[0]}
    else:
        structure: dict[str, dict[str, float]] = {"mass": {}, "inertia": {}, "stiffness": {}, "damping": {}}
        for a, (axis, inertia) in enumerate((("axial", "mass"), ("torsional", "inertia"))):
            for body in (1, 2):
                structure[inertia][f"body_{body}"] = float(matrices.mass[2 * a + body - 1, 2 * a + body - 1])
                for kind in ("stiffness", "damping"):
                    structure[kind][f"{axis}_{body}"] = truth.values[f"mount_{kind}_{axis}_{body}"]
            for kind in ("stiffness", "damping"):
                structure[kind][axis] = truth.values[f"joint_{kind}_{axis}"]
        rig = joint_rig(timestep=timestep).with_(elements=elements).with_structure(**structure)
        names = ("displacement_1", "displacement_2", "rotation_1", "rotation_2")
        rates = ("velocity_1", "velocity_2", "rotation_rate_1", "rotation_rate_2")
        drive = {"force": controls[0], "torque": controls[1]}
    record = simulate(rig, drive, sample_rate=truth.rate)
    position = np.column_stack([record[name] for name in names])
    velocity = np.column_stack([record[name] for name in rates])
    missing = np.zeros_like(position)
    for element, e in zip(elements, (x for x in effects if x.recipe.site == "joint"), strict=True):
        suffixes = [""] if e.recipe.n_coordinates == 1 else ["_1", "_2"]
        force = np.column_stack([record[f"{element.name}/force{s}"] for s in suffixes])
        missing += force @ ROWS[truth.rig][e.where]
    acting = fine[::each]
    # from the equation of motion: MuJoCo's own accelerometer sees the load of the middle of the step
    total = (
        acting @ matrices.inputs.T - velocity @ matrices.damping.T - position @ matrices.stiffness.T - missing
    )
    return TrueMotion(position, velocity, total @ np.linalg.inv(matrices.mass).T)


def force_under(truth: Truth, effects: Sequence[WithheldEffect], position: Array, velocity: Array) -> Array:
    """Force (n,) of a component along its prescribed motion, given finely (n * STEPS,)."""
    laws = [
        Acting(e.recipe.law, np.asarray(e.drawn.theta), ROWS[truth.rig][e.where], e.recipe.limit)
        for e in effects
        if e.recipe.law is not None
    ]
    force = truth.values["stiffness"] * position + truth.values["damping"] * velocity
    if laws:
        force = force + follow(
            laws, position=position, velocity=velocity, step=1.0 / (truth.rate * GROUND_TRUTH_SETTINGS.steps)
        )
    return force[:: GROUND_TRUTH_SETTINGS.steps]


def sensed(effects: Sequence[WithheldEffect], name: str, samples: Array, step: float) -> Array:
    """A channel after what its sensor does to it."""
    out = samples.copy()
    for e in effects:
        if e.recipe.site != "sensor" or e.recipe.target != name:
            continue
        v = e.drawn.values
        if "drift" in v:
            out = out + v["drift"] * np.arange(len(out)) / len(out)
        elif "bias" in v:
            out = out + v["bias"]
        elif "level" in v:
            out = np.clip(out, -v["level"], v["level"])
        elif "relative_error" in v:
            out = (1.0 + v["relative_error"]) * out
        elif "delay" in v:
            clock = step * np.arange(len(out))
            spline = make_interp_spline(clock, out, k=3)
            late = clock - v["delay"]
            out = np.where(late >= 0.0, spline(np.maximum(late, 0.0)), 0.0)
    return out
