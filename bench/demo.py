"""The main job: real friction damper and deck joint, identified, swapped in and compared on unseen tests.

Each part returns typed results; `run` writes them as a page, a rerun recording and Parquet records. The parts see
what a laboratory sees: motion and force records. The unseen tests' forces serve the scores and nothing else.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from bench.data import friction_damper
from bench.identification.network import fit_network, published_network
from bench.identification.parametric import Motion, fit_law
from bench.identification.polynomial import fit_polynomial
from bench.laws import find_law
from bench.recording import Recording, nmse, nrmse
from bench.reduction import Comparison, JointRecord, compare, element_from, joint_record, pool
from bench.rig import Element, Rig, simulate
from bench.rig.library import damper_rig, joint_rig, prescribe, starting
from bench.signals import BandLimitedNoise, Constant, Excitation

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of the whole that is done."""

TENSIONS = (20, 35, 70, 80)
"""Band tensions of the shipped friction-damper tests [lbf]."""
PEAK = 1000.0 * 4.4482216152605
"""The deck's load level, 1000 lbf [N]."""
PEAK_TORQUE = 1000.0 * 4.4482216152605 * 0.0254
"""1000 lbf in [N m]."""
DURATION = 30.0
RATE = 1000.0
CUTOFF = 12.0
UNSEEN_SEED = 2006


class DamperTest(NamedTuple):
    """An unseen damper test: identified at half its frequency, at the same band tension."""

    tension: int  # [lbf]
    measured: Recording
    simulated: dict[str, Recording]  # by model
    nrmse: dict[str, float]  # by model, force


class JointModel(NamedTuple):
    """A reduced-order joint and how it did."""

    label: str
    element: Element
    comparison: Comparison
    force_nmse: tuple[float, float]  # [%] axial, torsional, closed loop, unseen
    seconds: float  # fitting time; 0 where nothing was fitted


@dataclass(frozen=True)
class DemoResult:
    """Everything that the demo found.

    Attributes:
        damper: Unseen damper tests by tension.
        joint: Reduced-order joints on the unseen excitation.
        training: Training records of the joint.
        seconds: Wall-clock time [s] of the computation.
    """

    damper: tuple[DamperTest, ...]
    joint: tuple[JointModel, ...]
    training: tuple[Recording, ...] = field(repr=False)
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Figures as JSON values."""
        return {
            "damper": [{"tension_lbf": t.tension, "force_nrmse": t.nrmse} for t in self.damper],
            "joint": [
                {
                    "model": m.label,
                    "force_nmse_percent": {"axial": m.force_nmse[0], "torsional": m.force_nmse[1]},
                    "nmse_percent": m.comparison.nmse,
                    "fit_seconds": m.seconds,
                }
                for m in self.joint
            ],
            "seconds": self.seconds,
        }


def damper_motion(recording: Recording) -> Motion:
    """A damper record in SI units as motion and force."""
    return Motion(
        recording.time,
        recording["displacement"][:, None],
        np.gradient(recording["displacement"], 1.0 / recording.sample_rate)[:, None],
        recording["force"][:, None],
    )


def damper_record(frequency: str, tension: int) -> Recording:
    """A shipped friction-damper test in SI units."""
    return friction_damper(f"{frequency}Hz_{tension}lb").to_si()


def identify_damper(record: Recording, rng: np.random.Generator) -> dict[str, Element]:
    """Parametric, polynomial and network models of the damper, from one test, as elements on "piston"."""
    motion = damper_motion(record)
    peak, stroke = float(np.percentile(np.abs(motion.force), 90)), float(np.ptp(motion.displacement))
    law = find_law("jenkins_backlash")
    limits = {"limit_positive": (0.5 * peak, 1.5 * peak), "limit_negative": (0.5 * peak, 1.5 * peak)}
    parametric = fit_law(
        law,
        [Motion(*(column[::4] for column in motion))],
        start={
            "stiffness": 20.0 * peak / stroke,
            "soft_stiffness": 2.0 * peak / stroke,
            "clearance": 0.04 * stroke,
            "limit_positive": peak,
            "limit_negative": peak,
        },
        search={"stiffness": (5.0 * peak / stroke, 50.0 * peak / stroke), "clearance": (0.01 * stroke, 0.1 * stroke), "offset": (-0.1 * peak, 0.1 * peak), **limits},
        starts=4,
        rng=rng,
    )
    states = np.concatenate([motion.displacement, motion.velocity], axis=1)[::4]
    force = motion.force[::4]
    polynomial = fit_polynomial(states, force, orders=(5, 5))
    network = fit_network(states, force, n_hidden=15, rng=rng)
    return {
        "parametric": Element(parametric.law, ("piston",), parametric.theta, name="damper"),
        "polynomial": element_from(polynomial, ("piston",), name="damper"),
        "network": element_from(network, ("piston",), name="damper"),
    }


def damper_test(tension: int, rng: np.random.Generator) -> DamperTest:
    """Identify on the 0.5 Hz test, predict the 1 Hz test of the same tension from its motion alone."""
    elements = identify_damper(damper_record("0.5", tension), rng)
    unseen = damper_record("1", tension)
    x = unseen["displacement"]
    simulated, errors = {}, {}
    for label, element in elements.items():
        rig = damper_rig(element, timestep=1.0 / unseen.sample_rate)
        simulated[label] = simulate(rig, prescribe(rig, x), initial=starting(rig, x))
        errors[label] = nrmse(unseen["force"], simulated[label]["damper/force"])
    return DamperTest(tension, unseen, simulated, errors)


def excitation(axial: bool, torsional: bool) -> Excitation:
    """The deck's loading: noise flat to 12 Hz at ±1000 on the axes asked for, ramped in over half a second."""
    quiet = Constant(0.0)
    force = BandLimitedNoise(cutoff=CUTOFF, peak=PEAK) if axial else quiet
    torque = BandLimitedNoise(cutoff=CUTOFF, peak=PEAK_TORQUE) if torsional else quiet
    return Excitation({"force": force, "torque": torque}, duration=DURATION, sample_rate=RATE)


def training_records() -> tuple[Recording, ...]:
    """The three training records: axial only, torsional only, both (Tasbihgoo 2006, Fig 4.6)."""
    rig = joint_rig()
    return tuple(
        simulate(rig, excitation(axial, torsional), rng=np.random.default_rng(seed))
        for seed, (axial, torsional) in enumerate([(True, False), (False, True), (True, True)], start=1)
    )


def laboratory_view(recording: Recording, rig: Rig) -> JointRecord:
    """States and restoring forces of the joint as measured behind it: body 2's inertia and mount subtracted."""
    model = rig.model
    mounts = [model.joint(name) for name in ("axial_2", "torsional_2")]
    return joint_record(
        recording,
        displacements=("axial", "torsional"),
        velocities=("axial_velocity", "torsional_velocity"),
        accelerations=("acceleration_2_x", "angular_acceleration_2_x"),
        mount_displacements=("displacement_2", "rotation_2"),
        mount_velocities=("velocity_2", "rotation_rate_2"),
        inertias=[float(model.dof_M0[mount.dofadr[0]]) for mount in mounts],
        mount_stiffnesses=[float(mount.stiffness[0]) for mount in mounts],
        mount_dampings=[float(mount.damping[0]) for mount in mounts],
    )


def _joint_model(label: str, element: Element, seconds: float) -> JointModel:
    rig = joint_rig()
    comparison = compare(rig, rig.with_element(element), excitation(True, True), seed=UNSEEN_SEED)
    forces = tuple(
        nmse(comparison.true[f"joint/force_{i}"], comparison.reduced[f"joint/force_{i}"]) for i in (1, 2)
    )
    return JointModel(label, element, comparison, (forces[0], forces[1]), seconds)


def joint_models(records: tuple[Recording, ...], progress: Progress, done: float, share: float) -> list[JointModel]:
    """Identify the joint and put each model into the rig, beside the published network."""
    rig = joint_rig()
    data = pool([laboratory_view(record, rig) for record in records])
    axes = ("axial", "torsional")
    law, theta = published_network()
    models = [_joint_model("published network (30)", Element(law, axes, theta, name="joint"), 0.0)]
    fits: Mapping[str, Callable[[], Any]] = {
        "polynomial (order 3)": lambda: fit_polynomial(data.states, data.forces, orders=(3, 3, 3, 3)),
        "network (30)": lambda: fit_network(data.states, data.forces, n_hidden=30, rng=np.random.default_rng(30)),
        "network (40)": lambda: fit_network(data.states, data.forces, n_hidden=40, rng=np.random.default_rng(40)),
    }
    for number, (label, fit) in enumerate(fits.items()):
        progress(f"joint: fitting {label}", done + share * (0.05 + 0.95 * number / len(fits)))
        start = time.perf_counter()
        model = fit()
        models.append(_joint_model(label, element_from(model, axes), time.perf_counter() - start))
    return models


def compute(progress: Progress = lambda label, share: None) -> DemoResult:
    """Run both parts of the demo.

    Args:
        progress: Called with what is being done and the share done.
    """
    start = time.perf_counter()
    damper = []
    for number, tension in enumerate(TENSIONS):
        progress(f"damper: identifying at {tension} lbf band tension", 0.3 * number / len(TENSIONS))
        damper.append(damper_test(tension, np.random.default_rng(tension)))
    progress("joint: simulating the training records", 0.3)
    records = training_records()
    joint = joint_models(records, progress, 0.32, 0.66)
    progress("done", 1.0)
    return DemoResult(tuple(damper), tuple(joint), records, time.perf_counter() - start)
