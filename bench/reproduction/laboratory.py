"""The laboratory of C3: its rig, its drives and its sensors.

Drives, strain gauges, accelerometers and optical encoders are those of section 4.3. Analogue channels pass an anti-alias
filter; the encoders count and have none, so that their counts are passed through the same filter afterwards: a lag of the
force against the motion would otherwise be identified as damping. Velocities are differences of the encoders' positions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bench.demo.joint import laboratory_view
from bench.identification.restoring_force import JointData
from bench.laws.coupling import INCH, POUND_FORCE
from bench.measurement import AntiAlias, Chain, Noise, Quantisation, measure
from bench.recording import Recording
from bench.reproduction.joint_models import AXES, LOADINGS
from bench.rig import Element, Rig, simulate
from bench.rig.library import laboratory_joint_rig
from bench.signals import BandLimitedNoise, Constant, Excitation

FILTER = AntiAlias(100.0)


@dataclass(frozen=True)
class LaboratorySetup:
    """Numbers of `bench.reproduction.laboratory`."""

    force: float = 40.0
    torque: float = 15.5
    band: tuple[float, float] = (0.3, 10.0)
    duration: float = 30.0
    rate: float = 1000.0
    linear_count: float = INCH / 2000.0
    rotary_count: float = 2.0 * np.pi / 10_000.0
    seeds: Mapping[str, int] = field(default_factory=lambda: {"axial": 71, "torsional": 72, "both": 73})
    unseen_seeds: Mapping[str, int] = field(
        default_factory=lambda: {"axial": 81, "torsional": 82, "both": 83}
    )
    last_seed: int = 300
    """Further seeds of tests in the joint's place begin after it."""
    friction_share: float = 0.1
    """Friction of the universal joints over the peak of the restoring force; a tenth is what such joints have under load."""
    yield_: float = 0.005
    """Motion over which the friction builds up [in, rad]: ten counts of the linear encoder, a fortieth of the printed range."""


SETUP = LaboratorySetup()
POSITIONS = {
    "axial": ("axial_velocity", SETUP.linear_count),
    "torsional": ("torsional_velocity", SETUP.rotary_count),
    "displacement_1": ("velocity_1", SETUP.linear_count),
    "rotation_1": ("rotation_rate_1", SETUP.rotary_count),
}
"""Encoders: the velocity channel found from each, and the size of a count."""


def rig() -> Rig:
    """The laboratory rig with a joint of the printed size: gap, springs, dampers and coupling on both axes."""
    linear, torque = POUND_FORCE / INCH, POUND_FORCE * INCH
    joint = Element.of(
        "axial_torsional_joint",
        *AXES,
        name="joint",
        k_axial=60.0 * linear,
        c_axial=0.3 * linear,
        k_gap_axial=420.0 * linear,
        clearance_axial=0.08 * INCH,
        c_coupling_axial=4.0 * linear,
        k_torsional=60.0 * torque,
        c_torsional=0.3 * torque,
        k_gap_torsional=420.0 * torque,
        clearance_torsional=0.08,
        c_coupling_torsional=4.0 * POUND_FORCE,
    )
    return laboratory_joint_rig(joint)


def friction() -> tuple[Element, Element]:
    """Elastic-slip friction of the two universal joints, along the shaft and about it: a tenth of the printed peak force of 60."""
    limit = SETUP.friction_share * 60.0
    return (
        Element.of(
            "jenkins", "axial", name="friction_axial", limit=limit * POUND_FORCE, stiffness=limit / SETUP.yield_ * POUND_FORCE / INCH
        ),
        Element.of(
            "jenkins", "torsional", name="friction_torsional", limit=limit * POUND_FORCE * INCH,
            stiffness=limit / SETUP.yield_ * POUND_FORCE * INCH,
        ),
    )  # fmt: skip


def rig_with_friction() -> Rig:
    """The laboratory rig with the friction of its universal joints beside the joint."""
    return rig().with_(elements=(*rig().elements, *friction()))


def drive(loaded: tuple[bool, bool]) -> Excitation:
    """Uncorrelated noise on the axes asked for."""
    peaks = (SETUP.force * POUND_FORCE, SETUP.torque * POUND_FORCE * INCH)
    signals = [
        BandLimitedNoise(low=SETUP.band[0], cutoff=SETUP.band[1], peak=peak) if on else Constant(0.0)
        for peak, on in zip(peaks, loaded, strict=True)
    ]
    return Excitation(
        dict(zip(("force", "torque"), signals, strict=True)), duration=SETUP.duration, sample_rate=SETUP.rate
    )


def measured(record: Recording, rng: np.random.Generator) -> Recording:
    """A record of the rig as its sensors give it, filtered alike in all channels, with velocities from the encoders."""
    full_scale = {
        "load_cell_force": 400.0,
        "load_cell_torque": 10.0,
        "acceleration_1_x": 200.0,
        "angular_acceleration_1_x": 2000.0,
    }
    # Noise of a ten-thousandth of the range and 16 bits: a good amplifier and data-acquisition board.
    analogue = {
        name: Chain(FILTER, Noise(1e-4 * scale), Quantisation.from_bits(16, full_scale=scale))
        for name, scale in full_scale.items()
    }
    encoders = {name: Chain(Quantisation(count)) for name, (_, count) in POSITIONS.items()}
    sensed = measure(record, analogue | encoders, rng)
    sensed = measure(sensed, dict.fromkeys(POSITIONS, Chain(FILTER)))
    rates = {rate: np.gradient(sensed[name], 1.0 / SETUP.rate) for name, (rate, _) in POSITIONS.items()}
    return sensed.with_channels(rates)


def tests(seeds: Mapping[str, int]) -> dict[str, Recording]:
    """True records by loading."""
    return {
        name: simulate(rig(), drive(loaded), rng=np.random.default_rng(seeds[name]))
        for name, loaded in LOADINGS.items()
    }


def view(*records: Recording) -> JointData:
    """States and restoring forces that the laboratory finds at body 1."""
    return laboratory_view(records, rig())
