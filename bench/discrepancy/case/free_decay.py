"""Records without any load: free decays, which need none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord

NO_LOAD = "no load"
"""Name of the load that stands for none in a model of the user's own; zero throughout."""


def is_free_decay(case: Case) -> bool:
    """Whether a case has neither a load nor a prescribed motion."""
    if case.rig in {"damper", "joint"}:
        return False
    loads = {"force", "torque"} if not case.rig.endswith(".xml") else set()
    return not any(
        c.role != "response" or c.target.startswith("actuator:") or c.name in loads for c in case.channels
    )


def with_no_load(case: Case) -> Case:
    """A case with a load that is zero throughout, its records starting in motion: nothing else can have moved them."""
    name = NO_LOAD if case.rig.endswith(".xml") else "force"

    def decaying(record: CaseRecord) -> CaseRecord:
        zero = np.zeros(len(record))
        zero.setflags(write=False)
        return replace(record, values={**record.values, name: zero}, at_rest=record.periodic)

    return replace(
        case,
        channels=(*case.channels, CaseChannel(name, role="measured", noise_std=0.0)),
        identification=tuple(decaying(record) for record in case.identification),
        validation=tuple(decaying(record) for record in case.validation),
    )
