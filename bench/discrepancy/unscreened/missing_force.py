"""The external force that the nominal model lacks along the measured motion."""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.model.nominal_elements import own_force
from bench.discrepancy.model.structure import Place
from bench.discrepancy.response.simulator import Simulator


def missing_force(simulator: Simulator, record: CaseRecord, place: Place) -> Array:
    """External force (n,) along a coordinate that the nominal model lacks along the measured motion of a record."""
    motion, linear = simulator.motion_of(record), simulator.structure.at(simulator.nominal)
    held = motion.position @ linear.stiffness.T + motion.velocity @ linear.damping.T
    held = held + own_force(simulator.structure, simulator.nominal, motion, record.step)
    if simulator.driven:
        return held[:, 0] - record.values[simulator.structure.channels[0]]
    loads = np.column_stack([record.values[name] for name in simulator.structure.loads])
    left = motion.acceleration @ linear.mass.T + held - loads @ simulator.structure.inputs.T
    return np.asarray(np.linalg.lstsq(place.rows.T, left.T, rcond=None)[0][0], dtype=np.float64)


def driving(simulator: Simulator, record: CaseRecord) -> list[Array]:
    """What drives a record (n,) each: its loads; where the motion is prescribed, the force, which follows it."""
    structure = simulator.structure
    names = structure.channels if simulator.driven else structure.loads
    return [record.values[name] for name in names if name in record.values]
