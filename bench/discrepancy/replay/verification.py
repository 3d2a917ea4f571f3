"""What an applied verdict is worth in the user's own simulator, and which setting would do where it falls short."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.discrepancy.application.applying import (
    INTEGRATORS,
    Findings,
    RunOptions,
    apply,
    as_tested,
    specification,
)
from bench.discrepancy.application.forces import not_in_model
from bench.discrepancy.articulated.recognition import applies
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE as ARTICULATED
from bench.discrepancy.case.case import Case
from bench.discrepancy.checks.initial_motion import with_starts_found
from bench.discrepancy.effects.catalogue import CATALOGUE as LINEAR
from bench.discrepancy.model.model_units import in_model_units
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.replay.figures import Figure, WholeRun
from bench.discrepancy.replay.joint_replay import JointReplay
from bench.discrepancy.replay.linear_replay import LinearReplay
from bench.discrepancy.verdict import Gap, of_runs
from bench.errors import BenchError, ModelError


@dataclass(frozen=True)
class VerificationSettings:
    """Settings of the verification.

    Attributes:
        short: Part of the diagnosis's own figure by which the native form may miss it.
        refinements: Parts of the user's step that are tried where it does, in turn.
        converged: Part of the user's step at which a run counts as converged.
        matters: Part of the discrepancy from which the simulator's own share is named.
    """

    short: float = 0.05
    refinements: tuple[int, ...] = (2, 4, 10, 20)
    converged: int = 10
    matters: float = 0.1


@dataclass(frozen=True)
class Verification:
    """Before and after in the user's simulator.

    Attributes:
        step: Its step [s].
        integrator: Its integrator.
        figures: One a judged coordinate.
        own_share: NRMSE between the model as it came run as the user runs it, and run converged: fine steps, hard friction. What of
            the figure before is the simulator's own, not missing physics.
        remedy: What setting would do, in words; empty where nothing is short.
        less: Why less is left than the diagnosis says, in words; empty where it is not.
        better: Figures of what is short and of the worst with that setting.
        together: The same of all joints free at once; empty where there is one, or none.
    """

    step: float
    integrator: str
    figures: tuple[Figure, ...]
    own_share: float = 0.0
    remedy: str = ""
    less: str = ""
    better: tuple[Figure, ...] = ()
    together: tuple[WholeRun, ...] = ()

    @property
    def worst(self) -> Figure:
        """The coordinate that was widest open before."""
        return max(self.figures, key=lambda f: f.before / max(f.floor, 1e-12))

    @property
    def simulator_line(self) -> str:
        """The simulator's own share in one line; empty where it does not matter."""
        f = self.worst
        if self.own_share <= max(VerificationSettings().matters * f.before, f.floor):
            return ""
        return (
            f"your simulator's own share: {self.own_share:.3g} of {f.before:.3g}, by its step of {self.step:.3g} s, its integrator "
            f"({self.integrator}) and soft friction: the same model, converged, moves otherwise by as much"
        )

    @property
    def line(self) -> str:
        """The outcome in one line."""
        f = self.worst
        place = f" ({f.dof})" if f.dof else ""
        return f"in your simulator{place}: {f.before:.3g} -> {f.after:.3g} (diagnosis: {f.diagnosis:.3g})"

    @property
    def together_line(self) -> str:
        """What the worst joint does while all are free at once, in one line; empty where nothing was run so."""
        if not self.together:
            return ""
        worst = max(self.together, key=lambda f: f.before)
        return f"all joints free at once ({worst.dof}): {worst.before:.3g} -> {worst.after:.3g}"

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "step_s": self.step,
            "integrator": self.integrator,
            "figures": [vars(f) | {"short": f.short} for f in self.figures],
            "line": self.line,
            "simulator": self.own_share,
            "remedy": self.remedy,
            "less": self.less,
            "better": [vars(f) for f in self.better],
            "together": [vars(f) for f in self.together],
        }


Replay = JointReplay | LinearReplay


def is_articulated(findings: Findings, case: Case | None) -> bool:
    """Whether a verdict is one of the engine of articulated models: by the effects' parameters, else by the case."""
    for effect in findings.effects:
        own = set(effect.parameters)
        theirs = next((e for e in ARTICULATED if e.name == effect.name), None)
        others = next((e for e in LINEAR if e.name == effect.name), None)
        is_theirs = theirs is not None and own <= {p.name for p in theirs.parameters}
        is_others = others is not None and bool(effect.law or own <= {p.name for p in others.parameters})
        if is_theirs != is_others:
            return is_theirs
    return case is not None and applies(case)


@native.quiet()
def verify(
    path: str | Path,
    findings: Findings,
    gaps: Sequence[Gap],
    case: Case,
    *,
    settings: VerificationSettings | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Verification:
    """Run the judging records in plain MuJoCo with the user's own options, before and after.

    Args:
        path: The user's model.
        findings: What was found.
        gaps: The verdict's.
        case: The case of the verdict.
        settings: See there.
        progress: Called with a line of text at every stage.

    Raises:
        ModelError: The model is none that the judging records can be run with.
    """
    settings = settings or VerificationSettings()
    case, _ = in_model_units(case)
    articulated = is_articulated(findings, case)
    replay = replay_of(path, case, articulated=articulated, findings=findings)
    nothing = Findings(())

    def errors(
        what: Findings, options: RunOptions, only: Collection[str] = ()
    ) -> dict[str, NDArray[np.float64]]:
        applied = apply(path, what, case=case, linear=not articulated, options=options)
        return replay.errors(applied, what.effects, only)

    before = errors(nothing, RunOptions())

    def figures(options: RunOptions, only: Collection[str] = ()) -> tuple[Figure, ...]:
        after = errors(findings, options, only)
        return tuple(
            Figure(g.dof, root_mean_square(before[g.dof]), root_mean_square(after[g.dof]), *of_runs(g)[1:])
            for g in gaps
            if g.dof in before and g.dof in after
        )

    option = specification(path).option
    step, integrator = float(option.timestep), mujoco.mjtIntegrator(option.integrator)
    progress("the judging records in your simulator")
    found = figures(RunOptions())
    if not found:
        raise ModelError(
            f"the verdict judges {', '.join(g.dof or 'one coordinate' for g in gaps)}, the case something else; give the verdict's case"
        )
    out = Verification(step, INTEGRATORS[integrator], found, together=together(path, findings, case, replay))
    converged = RunOptions(step / settings.converged, mujoco.mjtIntegrator.mjINT_RK4, hard=True)
    widest = out.worst.dof
    own = root_mean_square(before[widest] - errors(nothing, converged, (widest,))[widest])
    out = replace(out, own_share=own)
    if _short(found) > settings.short:
        if lacking := not_in_model(findings.effects):
            return replace(out, remedy=f"{_missed(found)}: {lacking}")
        return _remedied(out, figures, settings, progress)
    least = min(found, key=lambda f: f.short)
    return out if least.short >= -settings.short else replace(out, less=_less(out, least, figures, settings))


def together(path: str | Path, findings: Findings, case: Case, replay: Replay) -> tuple[WholeRun, ...]:
    """Every joint before and after while all of them are free at once; empty where a case has one joint, or none.

    Args:
        path: The user's model.
        findings: What was found.
        case: The case of the verdict.
        replay: Its judging records.
    """
    if not isinstance(replay, JointReplay) or len(replay.model.joints) < 2:
        return ()
    before, after = (
        replay.errors(apply(path, what, case=case, linear=False), what.effects, together=True)
        for what in (Findings(()), findings)
    )
    return tuple(
        WholeRun(dof, root_mean_square(error), root_mean_square(after[dof])) for dof, error in before.items()
    )


_Figures = Callable[[RunOptions, Collection[str]], tuple[Figure, ...]]


def root_mean_square(error: NDArray[np.float64]) -> float:
    """Root of the mean square of all entries."""
    return float(np.sqrt(np.mean(error**2)))


def _short(found: Sequence[Figure]) -> float:
    return max(figure.short for figure in found)


def _less(out: Verification, least: Figure, figures: _Figures, settings: VerificationSettings) -> str:
    """Why a corrected model leaves less than the diagnosis says, in words: its step and integrator, if it leaves as much without them."""
    (fine,) = figures(RunOptions(out.step / settings.converged, mujoco.mjtIntegrator.mjINT_RK4), (least.dof,))
    place = "" if least is out.worst or not least.dof else f" of '{least.dof}'"
    less = f"the corrected model leaves {-100.0 * least.short:.0f} % less{place} than the diagnosis says at your step"
    words = f"{less}, and {fine.after:.3g} converged"
    return (
        f"{words}: with your step and integrator it errs as the records do"
        if abs(fine.short) <= settings.short
        else words
    )


def _remedied(
    out: Verification,
    figures: _Figures,
    settings: VerificationSettings,
    progress: Callable[[str], None],
) -> Verification:
    """Try other settings on what falls short until one does; say which, or that none of them does."""
    missed = {f.dof for f in out.figures if f.short > settings.short} | {out.worst.dof}
    trials: list[tuple[str, float, mujoco.mjtIntegrator | None]] = [
        (f"a step of {out.step / part:.3g} s", out.step / part, None) for part in settings.refinements
    ]
    if out.integrator != "RK4":
        runge, fine = mujoco.mjtIntegrator.mjINT_RK4, out.step / settings.converged
        trials.insert(0, (f"the integrator RK4 at the step of {out.step:.3g} s", out.step, runge))
        trials.append((f"the integrator RK4 at a step of {fine:.3g} s", fine, runge))
    best, label = tuple(f for f in out.figures if f.dof in missed), ""
    for name, step, integrator in trials:
        progress(f"with {name}")
        try:
            tried = figures(RunOptions(step, integrator), missed)
        except BenchError:
            continue
        if _short(tried) < _short(best):
            best, label = tried, name
        if _short(tried) <= settings.short:
            break
    words = _missed(out.figures)
    if not label:
        words += ", and neither a smaller step nor RK4 brings it nearer"
    else:
        worst = next(f for f in best if f.dof == out.worst.dof)
        words += f" at your step; {label} gives {worst.after:.3g}" + _rest(best, settings)
    return replace(out, remedy=words, better=best if label else ())


def _missed(figures: Sequence[Figure]) -> str:
    return f"the corrected model misses the diagnosis by {100.0 * _short(figures):.0f} %"


def _rest(best: Sequence[Figure], settings: VerificationSettings) -> str:
    """What the best setting still misses, in words, and whether noise alone leaves as much; empty where it misses nothing."""
    off = [figure for figure in best if figure.short > settings.short]
    if not off:
        return ""
    still = f", still {100.0 * _short(off):.0f} % off"
    if any(figure.after > figure.floor for figure in off):
        return still
    told = ", ".join(f"{figure.after:.3g} of {figure.floor:.3g} ({figure.dof})" for figure in off)
    return f"{still}, by less than noise alone leaves: {told}"


def replay_of(path: str | Path, case: Case, *, articulated: bool, findings: Findings | None = None) -> Replay:
    """What runs the judging records of a case in a model, with what was found in it.

    Raises:
        ModelError: The case is one of a rig of the bench.
    """
    if articulated:
        return JointReplay.of(case, as_tested(specification(path), case).compile(), findings)
    if not case.rig.endswith(".xml"):
        raise ModelError(
            f"the case is one of the rig '{case.rig}' of the bench; its records are run with a model of your own only where that is the rig"
        )
    case = with_starts_found(case)
    return LinearReplay.of(case, structure_of(case))
