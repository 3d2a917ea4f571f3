"""A stick-slip joint in the chain of eight degrees of freedom: identified on the rig of two bodies, put into the chain.

The deck's joint with LuGre friction beside it on both axes, a tenth of the peak load, that breaks away at 1.5 times its sliding
force. The models are identified from the three records of the two-body rig and meet other motions in the chain. The joint with
memory has no term that weakens with speed: what that costs is what this task shows.
"""

from __future__ import annotations

import numpy as np

from bench.demo.joint import JOINT_SETUP, excitation, laboratory_view
from bench.laws.coupling import INCH
from bench.reproduction.joint_models import LOADINGS, SETUP
from bench.rig import Element, Rig, simulate
from bench.rig.library import chain_rig, joint_rig
from memory.row import Progress, Row
from memory.two_axes import Bench, Test, scored

TIMESTEP = 2e-4
AXES = ("axial_23", "torsional_23")


def true_joint(axes: tuple[str, str]) -> tuple[Element, ...]:
    """The deck's joint and its friction."""
    found = [Element.of("axial_torsional_joint", *axes, name="joint")]
    for joint, peak, unit in zip(axes, (JOINT_SETUP.peak, JOINT_SETUP.peak_torque), (INCH, 1.0), strict=True):
        limit = 0.1 * peak
        found.append(
            Element.of(
                "lugre", joint, name=f"friction_{joint}", limit=limit, bristle_stiffness=limit / (0.01 * unit),
                bristle_damping=0.0, boost=0.5, stribeck_velocity=0.5 * unit, viscous=0.0,
            )
        )  # fmt: skip
    return tuple(found)


def _chain(elements: tuple[Element, ...]) -> Rig:
    return chain_rig(*elements, timestep=TIMESTEP)


def rows(progress: Progress) -> list[Row]:
    """Rows of the task."""
    progress("true records")
    two = true_joint(("axial", "torsional"))
    rig = joint_rig(*two, timestep=TIMESTEP)
    records = [
        simulate(rig, excitation(*loaded), rng=np.random.default_rng(seed), sample_rate=1000.0)
        for seed, loaded in enumerate(LOADINGS.values(), start=1)
    ]
    true, seed = true_joint(AXES), SETUP.unseen_seeds["both"]
    drive = excitation(True, True)
    unseen = simulate(_chain(true), drive, rng=np.random.default_rng(seed), sample_rate=1000.0)
    bench = Bench(_chain, AXES, {"both": Test(drive, seed, unseen)})
    return scored("stick-slip joint in the chain", bench, laboratory_view(records, rig), true, None, progress)
