"""The deck's axial-torsional joint: identified from three records, swapped into the rig, tried on unseen excitation."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import RangeWarning, SimulationError
from bench.identification.network import fit_network
from bench.identification.polynomial import fit_polynomial
from bench.identification.restoring_force import JointData, joint_data
from bench.laws.along import force_along
from bench.laws.coupling import INCH, POUND_FORCE
from bench.laws.network import published_network
from bench.progress import ShowProgress
from bench.recording import Recording, nmse
from bench.reduction import Comparison, channel_nmse, element_from
from bench.rig import Element, Rig, simulate
from bench.rig.library import inertia_of, joint_rig
from bench.signals import BandLimitedNoise, Constant, Excitation


@dataclass(frozen=True)
class JointSetup:
    """Numbers of `bench.demo.joint`."""

    peak: float = 1000.0 * POUND_FORCE
    """The deck's load level, 1000 lbf [N]."""
    peak_torque: float = 1000.0 * POUND_FORCE * INCH
    """1000 lbf in [N m]."""
    duration: float = 30.0
    rate: float = 1000.0
    cutoff: float = 12.0
    unseen_seed: int = 2006
    network_samples: int = 6000
    """Samples of the networks' last stage: enough for the errors promised here, in half the time of the default."""


JOINT_SETUP = JointSetup()


class DemoJoint(NamedTuple):
    """A reduced-order joint and how it did."""

    label: str
    element: Element
    comparison: Comparison | None  # None where the rig with this joint diverged
    force_nmse: tuple[float, float] | None  # [%] axial, torsional, closed loop, unseen
    open_loop_nmse: tuple[float, float]  # [%] on the true states of the unseen test
    seconds: float  # fitting time; 0 where nothing was fitted
    note: str  # what the simulation said: divergence, or leaving the range of the data; empty where nothing


def excitation(axial: bool, torsional: bool) -> Excitation:
    """The deck's loading: noise flat to 12 Hz at ±1000 on the axes asked for, ramped in over half a second."""
    quiet = Constant(0.0)
    force = BandLimitedNoise(cutoff=JOINT_SETUP.cutoff, peak=JOINT_SETUP.peak) if axial else quiet
    torque = BandLimitedNoise(cutoff=JOINT_SETUP.cutoff, peak=JOINT_SETUP.peak_torque) if torsional else quiet
    return Excitation(
        {"force": force, "torque": torque}, duration=JOINT_SETUP.duration, sample_rate=JOINT_SETUP.rate
    )


def training_records() -> tuple[Recording, ...]:
    """The three training records: axial only, torsional only, both (Tasbihgoo 2006, Fig 4.6)."""
    rig = joint_rig()
    return tuple(
        simulate(rig, excitation(axial, torsional), rng=np.random.default_rng(seed))
        for seed, (axial, torsional) in enumerate([(True, False), (False, True), (True, True)], start=1)
    )


def unseen_record() -> Recording:
    """The true joint's response to an excitation of another seed, both axes loaded."""
    return simulate(joint_rig(), excitation(True, True), rng=np.random.default_rng(JOINT_SETUP.unseen_seed))


def laboratory_view(records: Sequence[Recording], rig: Rig, *, mass_known: bool = True) -> JointData:
    """States and restoring forces of the joint as measured at body 1: its loads less its inertia and mounts.

    With `mass_known` false its loads less its mounts, and its accelerations, as section 4.5 has it.
    """
    model = rig.model
    mounts = [model.joint(name) for name in ("axial_1", "torsional_1")]
    return joint_data(
        records,
        displacements=("axial", "torsional"),
        velocities=("axial_velocity", "torsional_velocity"),
        applied=("load_cell_force", "load_cell_torque"),
        accelerations=("acceleration_1_x", "angular_acceleration_1_x"),
        body_displacements=("displacement_1", "rotation_1"),
        body_velocities=("velocity_1", "rotation_rate_1"),
        mass=[inertia_of(rig, name) for name in ("axial_1", "torsional_1")] if mass_known else None,
        stiffness=[float(mount.stiffness[0]) for mount in mounts],
        damping=[float(mount.damping[0]) for mount in mounts],
        body="first",
    )


def _pair(
    true: Recording, forces: NDArray[np.float64] | Sequence[NDArray[np.float64]]
) -> tuple[float, float]:
    return nmse(true["joint/force_1"], forces[0]), nmse(true["joint/force_2"], forces[1])


def _joint_model(label: str, element: Element, unseen: Recording, seconds: float) -> DemoJoint:
    """Score a model on the true states of the unseen test, and in the true joint's place in the rig."""
    q = np.stack([unseen["axial"], unseen["torsional"]], axis=1)
    v = np.stack([unseen["axial_velocity"], unseen["torsional_velocity"]], axis=1)
    open_loop = _pair(unseen, force_along(element.law, element.theta, unseen.time, q, v).T)
    rig = joint_rig()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RangeWarning)
        try:
            reduced = simulate(
                rig.with_element(element),
                excitation(True, True),
                rng=np.random.default_rng(JOINT_SETUP.unseen_seed),
            )
        except SimulationError as error:
            return DemoJoint(label, element, None, None, open_loop, seconds, str(error))
    note = " ".join(str(warning.message) for warning in caught)
    comparison = Comparison(unseen, reduced, channel_nmse(unseen, reduced))
    forces = _pair(unseen, [reduced["joint/force_1"], reduced["joint/force_2"]])
    return DemoJoint(label, element, comparison, forces, open_loop, seconds, note)


def joint_models(
    records: tuple[Recording, ...],
    unseen: Recording,
    progress: ShowProgress,
    span: tuple[float, float] = (0.0, 1.0),
) -> list[DemoJoint]:
    """Identify the joint and put each model into the rig, beside the published network.

    Args:
        records: Training records.
        unseen: The true joint's record of the unseen test.
        progress: Called with what is being done and the share done.
        span: Shares at the start and the end.
    """
    data = laboratory_view(records, joint_rig())
    axes = ("axial", "torsional")
    published = published_network()
    printed = Element(published.law, axes, published.theta, name="joint")
    models = [_joint_model("published network (30)", printed, unseen, 0.0)]
    thin = slice(None, None, 4)  # neighbouring samples at 1 kHz say nothing new about a joint moving at 12 Hz
    fits: Mapping[str, Callable[[], Any]] = {
        "polynomial (order 3)": lambda: fit_polynomial(
            data.states[thin], data.forces[thin], orders=(3, 3, 3, 3)
        ),
        "polynomial (total degree 5)": lambda: fit_polynomial(
            data.states[thin], data.forces[thin], orders=(5, 5, 5, 5), kind="total"
        ),
        "network (30)": lambda: fit_network(
            data.states,
            data.forces,
            n_hidden=30,
            max_samples=JOINT_SETUP.network_samples,
            rng=np.random.default_rng(30),
        ),
        "network (40)": lambda: fit_network(
            data.states,
            data.forces,
            n_hidden=40,
            max_samples=JOINT_SETUP.network_samples,
            rng=np.random.default_rng(40),
        ),
    }
    for number, (label, fit) in enumerate(fits.items()):
        progress(f"joint: fitting {label}", span[0] + (span[1] - span[0]) * number / len(fits))
        start = time.perf_counter()
        model = fit()
        seconds = time.perf_counter() - start
        models.append(_joint_model(label, element_from(model, axes), unseen, seconds))
    return models
