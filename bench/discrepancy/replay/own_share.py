"""The simulator's own share of a discrepancy, named as a location: the nominal model as its owner runs it against itself, converged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco

from bench.discrepancy.application.applying import INTEGRATORS, Findings, RunOptions, apply, specification
from bench.discrepancy.case.case import Case
from bench.discrepancy.replay.verification import (
    VerificationSettings,
    is_articulated,
    replay_of,
    root_mean_square,
)
from bench.discrepancy.verdict import Location, Verdict, of_runs
from bench.errors import BenchError

SIMULATOR = "simulator"
"""Kind of the location."""


def with_simulator(verdict: Verdict, case: Case, settings: VerificationSettings | None = None) -> Verdict:
    """The verdict with the simulator among its locations where that matters: step, integrator and soft friction of the user's MJCF.

    Its share is the NRMSE between the two runs over that of the nominal model. A verdict whose model cannot be replayed stays as it is.

    Args:
        verdict: The verdict.
        case: Its case.
        settings: When it matters.
    """
    own = settings or VerificationSettings()
    if not case.rig.endswith(".xml") or not verdict.gaps:
        return verdict
    path = Path(case.folder or ".") / case.rig
    nothing = Findings(())
    articulated = is_articulated(nothing, case)
    try:
        replay = replay_of(path, case, articulated=articulated)
        option = specification(path).option
        step, integrator = float(option.timestep), INTEGRATORS[mujoco.mjtIntegrator(option.integrator)]
        fine = RunOptions(step / own.converged, mujoco.mjtIntegrator.mjINT_RK4, hard=True)
        worst = max(verdict.gaps, key=lambda gap: of_runs(gap)[0] / max(of_runs(gap)[2], 1e-12))
        runs = [
            replay.errors(
                apply(path, nothing, case=case, linear=not articulated, options=options), (), (worst.dof,)
            )
            for options in (RunOptions(), fine)
        ]
    except (BenchError, KeyError):
        return verdict
    if worst.dof not in runs[0]:
        return verdict
    before, _, floor = of_runs(worst)
    share = root_mean_square(runs[0][worst.dof] - runs[1][worst.dof])
    if not share > max(own.matters * before, floor):
        return verdict
    record = case.validation[0]
    place = Location(
        SIMULATOR,
        worst.dof,
        min(share / max(before, 1e-12), 1.0),
        (0.0, 0.5 / record.step),
        (0.0, record.step * (len(record) - 1)),
        p_value=0.0,
        kind=SIMULATOR,
    )
    text = (
        f"the simulator itself: your model run with its step of {step:.3g} s, {integrator} and its soft friction moves otherwise by "
        f"{share:.3g} (NRMSE) than the same model converged, of a gap of {before:.3g}: what is named here is missing from the "
        "converged model; use a smaller step or RK4, or a harder solreffriction"
    )
    return replace(verdict, locations=(*verdict.locations, place), warnings=(text, *verdict.warnings))
