"""What was named, in the user's own simulator, as a report draws it: the first judging record, and the figure before and after."""

from __future__ import annotations

from pathlib import Path

from bench import native
from bench.discrepancy.application.applying import INTEGRATORS, Findings, apply, specification
from bench.discrepancy.application.reading import findings_of
from bench.discrepancy.case.case import Case
from bench.discrepancy.replay.verification import (
    Figure,
    Verification,
    is_articulated,
    replay_of,
    root_mean_square,
    together,
)
from bench.discrepancy.verdict import InSimulator, Verdict
from bench.errors import BenchError


@native.quiet()
def in_simulator(verdict: Verdict, case: Case) -> InSimulator | None:
    """Run the judging records in the case's own MJCF with what was named, at its own step and integrator.

    Args:
        verdict: The verdict.
        case: Its case.

    Returns:
        The outcome; None where nothing was named, the rig is one of the bench, or the model cannot be run with it, of which
        `jointbench apply` tells the reason.
    """
    if not verdict.named or not case.rig.endswith(".xml"):
        return None
    path = Path(case.folder or ".") / case.rig
    findings = findings_of(verdict)
    articulated = is_articulated(findings, case)
    try:
        replay = replay_of(path, case, articulated=articulated, findings=findings)
        before, after = (
            apply(path, what, case=case, linear=not articulated) for what in (Findings(()), findings)
        )
        was, errors = replay.errors(before, ()), replay.errors(after, findings.effects)
        record = {name: own[0].simulated for name, own in replay.readings(after, findings.effects).items()}
    except (BenchError, KeyError):
        return None
    figures = tuple(
        Figure(g.dof, root_mean_square(was[g.dof]), root_mean_square(errors[g.dof]), g.after, g.noise_floor)
        for g in verdict.gaps
        if g.dof in was
    )
    if not figures:
        return None
    option = specification(path).option
    whole = together(path, findings, case, replay)
    told = Verification(float(option.timestep), INTEGRATORS[option.integrator], figures, together=whole)
    return InSimulator("; ".join(filter(None, (told.line, told.together_line))), record)
