"""C3 with the friction of the real joint: the laboratory rig with its universal joints, measured by its sensors.

The rig is integrated at 5 kHz: its friction builds up over 5 thousandths of an inch, which the joint passes within a millisecond.
"""

from __future__ import annotations

import numpy as np

from bench.reproduction import laboratory
from bench.reproduction.joint_models import LOADINGS
from bench.rig import Element, Rig, simulate
from memory.row import Progress, Row
from memory.two_axes import Bench, Test, scored

TIMESTEP = 2e-4
LIMIT = 1.0
"""Largest NMSE of a force in closed loop [%]."""


def _rig(elements: tuple[Element, ...]) -> Rig:
    return laboratory.rig().with_(elements=elements, timestep=TIMESTEP)


def rows(progress: Progress) -> list[Row]:
    """Rows of the task."""
    progress("true records")
    true = laboratory.rig_with_friction().elements
    records, tests = [], {}
    rng = np.random.default_rng(70)
    for name, loaded in LOADINGS.items():
        drive = laboratory.drive(loaded)
        seeds = laboratory.SETUP.seeds[name], laboratory.SETUP.unseen_seeds[name]
        seen, unseen = (
            simulate(_rig(true), drive, rng=np.random.default_rng(seed), sample_rate=laboratory.SETUP.rate)
            for seed in seeds
        )
        records.append(laboratory.measured(seen, rng))
        tests[name] = Test(drive, seeds[1], unseen)
    bench = Bench(_rig, laboratory.AXES, tests)
    return scored("C3 with friction", bench, laboratory.view(*records), true, LIMIT, progress)
