"""The external force that the nominal model lacks along the measured motion."""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.model.nominal_elements import own_force
from bench.discrepancy.model.structure import Place
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.unscreened.spectral_lines import SpectralLine, lines_of


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


def free_lines(simulator: Simulator, record: CaseRecord, signal: Array) -> list[SpectralLine]:
    """Lines in the spectrum of a signal (n,) of a record, but for those of its loads, or of a prescribed motion; the largest first."""
    structure = simulator.structure
    names = structure.channels if simulator.driven else structure.loads
    drives = [record.values[name] for name in names if name in record.values]
    return lines_of(record.time, signal, drives, settings=simulator.settings.search.harmonic)
