"""The diagnosis of an articulated model: where the discrepancy lies joint by joint, which effect causes it, how far it shrinks.

`applies` tells whether a case is one for this engine rather than for linear structures: a servo, a parameter of a drive, or inertia that
changes with the posture.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated.effects import CATALOGUE
from bench.discrepancy.articulated.fitting import ArticulatedFit
from bench.discrepancy.articulated.judgement import (
    Prediction,
    closed,
    complete,
    kept,
    ladder,
    predict,
)
from bench.discrepancy.articulated.problem import (
    ArticulatedProblem,
    Hypothesis,
    Placed,
    nominal_parameters,
    placed_values,
    placements,
)
from bench.discrepancy.articulated.search import search
from bench.discrepancy.case.case import Case
from bench.discrepancy.effects.catalogue import CATALOGUE as LINEAR
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.encoders import encoders_of, input_of
from bench.discrepancy.multibody.model import DRIVES, ArticulatedModel, compiled_model
from bench.discrepancy.settings import DEFAULT, ArticulatedSettings, DiagnosisSettings, changed
from bench.discrepancy.settings import ArticulatedJudgementSettings as JudgementSettings
from bench.discrepancy.verdict import (
    Estimate,
    Gap,
    Kind,
    Location,
    NamedEffect,
    NominalEstimate,
    Ranked,
    Verdict,
)
from bench.errors import BenchError, UnknownNameError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ArticulatedDiagnosis:
    """A diagnosis with everything that its report needs.

    Attributes:
        case: The case.
        model: Its model.
        problem: Its records for identification.
        judging: Its records for judging.
        fits: All fitted hypotheses, the likeliest first.
        final: The one behind `verdict`.
        matrix: Joint to effect to the part of that joint's discrepancy that the effect alone closes, where it was fitted.
        verdict: The verdict.
    """

    case: Case
    model: ArticulatedModel
    problem: ArticulatedProblem
    judging: ArticulatedProblem
    fits: tuple[ArticulatedFit, ...]
    final: ArticulatedFit
    matrix: dict[str, dict[str, float]]
    verdict: Verdict


def applies(case: Case, *, settings: ArticulatedSettings = DEFAULT.articulated) -> bool:
    """Whether the rig of a case is an MJCF of several joints with servos, parameters of drives, or inertia that changes with posture."""
    path = Path(case.folder or ".") / case.rig
    if case.rig in ("sdof", "joint", "damper") or not path.is_file():
        return False
    if any(p.name.partition(":")[0] in DRIVES for p in case.parameters):
        return True
    try:
        model = compiled_model(path)
    except BenchError:
        return False  # refused where the model is read for a diagnosis
    # one joint on its own is a linear structure first: forces on it have a larger catalogue there
    servos = model.nv > 1 and model.nu and np.any(np.asarray(model.actuator_biasprm)[:, 1] != 0.0)
    return bool(servos) or _posture_matters(model, settings=settings)


def drives_only(case: Case) -> bool:
    """Whether every joint of the rig of a case, an MJCF, is measured and driven on its own, so that this engine can be asked, too."""
    path = Path(case.folder or ".") / case.rig
    if case.rig in ("sdof", "joint", "damper") or not path.is_file():
        return False
    try:
        compiled = compiled_model(path)
        model, own = ArticulatedModel.of(compiled), bound(case, compiled)
        for joint in model.joints:
            encoders_of(own, joint)
            input_of(own, joint)
        nominal_parameters(own, model)
    except BenchError:
        return False
    return True


@native.quiet()
def _posture_matters(model: mujoco.MjModel, *, settings: ArticulatedSettings) -> bool:
    if model.nv != model.njnt or model.nv < 2:
        return False
    rng = np.random.default_rng(0)
    data, matrices = mujoco.MjData(model), []
    for _ in range(settings.postures):
        data.qpos[:] = model.qpos0 + rng.uniform(-1.0, 1.0, model.nq)
        mujoco.mj_forward(model, data)
        matrices.append(np.array(data.M))
    spread = np.ptp(matrices, axis=0)
    return bool(np.max(spread) > 1e-6 * np.max(np.abs(matrices)))


def diagnose_articulated(
    case: Case,
    *,
    exclude: Collection[str] = (),
    most: int = 3,
    anyway: bool = False,
    rng: np.random.Generator | None = None,
    settings: DiagnosisSettings = DEFAULT,
    progress: Callable[[str], None] = lambda text: None,
) -> ArticulatedDiagnosis:
    """Diagnose a case whose rig is an articulated MJCF.

    Args:
        case: Nominal model and records.
        exclude: Names of effects to leave out of the catalogue.
        most: Largest number of effects named together.
        anyway: Whether factors, signs and parts of the model that stand against a diagnosis are noted rather than refused.
        rng: For the bootstrap intervals; a fixed seed where None.
        settings: Thresholds, see docs/thresholds.md.
        progress: Called with a line of text at every stage.

    Raises:
        UnknownNameError: A name in `exclude` is not in the catalogue.
        ModelError: The model has something that is no hinge or slide on a fixed base, or that the equations of its joints leave out
            and the records reach.
        FileFormatError: A joint is not measured or not driven.
        RecordingError: The records cannot be used.
        UnitError: A unit does not fit the model, or a channel is off by a factor or a sign that no missing force makes.
    """
    began = time.perf_counter()
    rng = np.random.default_rng(settings.seed) if rng is None else rng
    how, judged = replace(settings.articulated.search, most=most), settings.articulated.judgement
    known = {effect.name for effect in (*CATALOGUE, *LINEAR)}
    for name in exclude:
        if name not in known:
            raise UnknownNameError("effect", name, sorted(known))
    catalogue = [effect for effect in CATALOGUE if effect.name not in exclude]
    progress("reading the model and the records")
    stated = all((c.noise_std or 0.0) > 0.0 for c in case.channels if c.role == "response")
    case, compiled, notes = admitted_robot(case, anyway=anyway, settings=settings)
    model = ArticulatedModel.of(compiled, case.rig)
    problem = ArticulatedProblem.of(case, model, case.identification, settings)
    judging = ArticulatedProblem.of(case, model, case.validation, settings)
    fits = search(problem, placements(problem, catalogue), settings=how, progress=progress)
    progress("judging records")
    rungs = ladder(fits)
    last, predictions = kept(judging, rungs, judged)
    untouched = predict(judging, None, predictions[0].floor, judged)
    final = rungs[last]
    verdict = _verdict(problem, fits, rungs, last, untouched, predictions, judged, rng, stated=stated)
    verdict = replace(verdict, warnings=(*verdict.warnings, *notes), settings=changed(settings))
    verdict = verdict.timed(time.perf_counter() - began)
    return ArticulatedDiagnosis(
        case, model, problem, judging, tuple(fits), final, _matrix(problem, fits), verdict
    )


def _verdict(
    problem: ArticulatedProblem,
    fits: Sequence[ArticulatedFit],
    rungs: Sequence[ArticulatedFit],
    last: int,
    untouched: Prediction,
    predictions: Sequence[Prediction],
    settings: JudgementSettings,
    rng: np.random.Generator,
    *,
    stated: bool,
) -> Verdict:
    final, base = rungs[last], rungs[0]
    whole = stated and complete(problem, final, settings)
    explained, _ = closed(predictions[0], predictions[last], predictions[0], rng)
    kind: Kind = "effect" if last else "none"
    if not whole and (not last or explained < settings.material):
        kind = "unknown"
    shares = [closed(predictions[k - 1], predictions[k], predictions[0], rng) for k in range(1, last + 1)]
    probabilities = _probabilities(fits, final, kind, settings)
    effects = tuple(
        _named(problem, final, k, shares[k], probabilities, settings) for k in range(len(final.hypothesis))
    )
    effects = tuple(sorted(effects, key=lambda e: -e.closed))
    gaps = _gaps(problem, rungs[: last + 1], untouched, predictions[: last + 1], rng)
    widest = max(gaps, key=lambda gap: gap.before / max(gap.noise_floor, 1e-12))
    return Verdict(
        verdict=kind,
        named=effects if kind == "effect" else (),
        ranking=_ranking(fits, final, settings),
        indistinguishable=_sets(fits, final, settings) if kind == "effect" else (),
        locations=_locations(problem, base),
        gap=widest,
        gaps=gaps,
        probabilities=probabilities,
        explanation=_words(kind, effects, whole, explained, final, problem),
        warnings=(),
        complete=whole,
        remainder=_remainder(problem, final, predictions[last], untouched),
        nominal=_nominal(problem, final),
    )


def _name(placed: Placed) -> str:
    return f"{placed.effect.name} ({placed.where})"


def _words(
    kind: Kind,
    effects: Sequence[NamedEffect],
    whole: bool,
    explained: float,
    final: ArticulatedFit,
    problem: ArticulatedProblem,
) -> str:
    names = " and ".join(f"{e.name} ({e.where})" for e in effects)
    left = "" if whole else f" {_left(problem, final)}"
    if kind == "none":
        return (
            "The stated uncertainties and the noise explain the records; nothing is missing from the model."
        )
    if kind == "effect":
        return (
            f"Missing from the model: {names}. With it the records are explained to within their noise."
            if whole
            else (
                f"Missing from the model: {names}, which closes {100.0 * explained:.3g} % of the discrepancy on the judging records.{left}"
            )
        )
    if effects:
        return (
            f"Something is missing from the model, and no effect of the catalogue closes most of it; the nearest is {names}, "
            f"with {100.0 * explained:.3g} %.{left}"
        )
    return f"Something is missing from the model, and no effect of the catalogue improves on the judging records.{left}"


def _left(problem: ArticulatedProblem, final: ArticulatedFit) -> str:
    j = int(np.argmax(final.reduced))
    return (
        f"Joint '{problem.joints[j].name}' still leaves {np.sqrt(final.reduced[j]):.3g} times its noise: "
        "something more is missing, or the noise is larger than stated."
    )


def _probabilities(
    fits: Sequence[ArticulatedFit], final: ArticulatedFit, kind: Kind, settings: JudgementSettings
) -> dict[str, float]:
    known = 1.0 - settings.outside
    if kind == "unknown":
        return {"effect": settings.outside, "none": 0.0, "unknown": known}
    logs = np.array([f.log_posterior for f in fits if len(f.hypothesis) <= len(final.hypothesis)])
    empty = np.array([not f.hypothesis for f in fits if len(f.hypothesis) <= len(final.hypothesis)])
    shares = np.exp(logs - logs.max())
    none = float(shares[empty].sum() / shares.sum())
    if kind == "none":  # what the search would add is not borne out
        none = max(none, 0.95)
    return {"effect": known * (1.0 - none), "none": known * none, "unknown": settings.outside}


def _rivals(
    fits: Sequence[ArticulatedFit], final: ArticulatedFit, settings: JudgementSettings
) -> list[tuple[ArticulatedFit, float]]:
    """Explanations of as many effects, by what they are less likely than the final one."""
    out: dict[frozenset[tuple[str, str]], tuple[ArticulatedFit, float]] = {}
    for f in fits:
        if len(f.hypothesis) == len(final.hypothesis):
            key = frozenset(placed.key for placed in f.hypothesis)
            out.setdefault(key, (f, max(final.log_posterior - f.log_posterior, 0.0)))
    out[frozenset(placed.key for placed in final.hypothesis)] = (final, 0.0)
    return list(out.values())


def _ranking(
    fits: Sequence[ArticulatedFit], final: ArticulatedFit, settings: JudgementSettings
) -> tuple[Ranked, ...]:
    rivals = _rivals(fits, final, settings)
    weights = np.exp([-behind for _, behind in rivals])
    weights = (1.0 - settings.outside) * weights / weights.sum()
    total: dict[tuple[str, str], float] = {}
    for (f, _), weight in zip(rivals, weights, strict=True):
        for placed in f.hypothesis:
            total[placed.key] = total.get(placed.key, 0.0) + float(weight)
    ordered = sorted(total.items(), key=lambda item: -item[1])
    return tuple(Ranked(name, where, probability) for (name, where), probability in ordered)


def _sets(
    fits: Sequence[ArticulatedFit], final: ArticulatedFit, settings: JudgementSettings
) -> tuple[tuple[str, ...], ...]:
    own = {placed.key for placed in final.hypothesis}
    sets: dict[str, set[str]] = {}
    for f, behind in _rivals(fits, final, settings):
        theirs = {placed.key for placed in f.hypothesis}
        lost, gained = own - theirs, theirs - own
        if behind <= settings.rival and len(lost) == 1 and len(gained) == 1:
            (mine,), (other,) = lost, gained
            if mine[0] != other[0]:
                sets.setdefault(mine[0], {mine[0]}).add(other[0])
    return tuple(tuple(sorted(entry)) for entry in sets.values())


def _named(
    problem: ArticulatedProblem,
    final: ArticulatedFit,
    k: int,
    share: tuple[float, tuple[float, float]],
    probabilities: dict[str, float],
    settings: JudgementSettings,
) -> NamedEffect:
    placed = final.hypothesis[k]
    at = len(problem.nominal) + sum(len(p.effect.parameters) for p in final.hypothesis[:k])
    eta = final.vector[at : at + len(placed.effect.parameters)]
    std = np.sqrt(np.maximum(np.diag(final.covariance)[at : at + len(eta)], 0.0))
    values = placed_values(placed, eta)
    joint = problem.joints[placed.joint]
    estimates = {
        p.name: Estimate(
            float(values[p.name]),
            float(abs(p.slope(float(e), placed.scales)) * s),
            placed.effect.unit(p, joint.unit),
        )
        for p, e, s in zip(placed.effect.parameters, eta, std, strict=True)
    }
    return NamedEffect(
        name=placed.effect.name,
        where=placed.where,
        probability=probabilities["effect"],
        parameters=estimates,
        channel=joint.name,
        equation=placed.effect.equation,
        closed=share[0],
        closed_ci95=share[1],
    )


def _gaps(
    problem: ArticulatedProblem,
    rungs: Sequence[ArticulatedFit],
    untouched: Prediction,
    predictions: Sequence[Prediction],
    rng: np.random.Generator,
) -> tuple[Gap, ...]:
    out = []
    for j, joint in enumerate(problem.joints):
        record = problem.records[0].joints[j]
        run = f"free runs of {record.window * record.sample:.3g} s" if record.window else "free run"
        first, after = untouched, predictions[-1]
        floor = float(after.floor[j])
        one = [Prediction(p.power[:, j : j + 1], p.floor[j : j + 1]) for p in (first, after)]
        share, interval = closed(one[0], one[1], one[0], rng)
        steps = [
            ("nominal", float(first.discrepancy[j])),
            ("parameters only", float(predictions[0].discrepancy[j])),
        ]
        steps += [
            (" + ".join(_name(p) for p in rung.hypothesis), float(p.discrepancy[j]))
            for rung, p in zip(rungs[1:], predictions[1:], strict=True)
        ]
        out.append(
            Gap(
                f"validation {joint.name} position NRMSE, {run}, other joints as measured", float(first.discrepancy[j]),
                float(predictions[0].discrepancy[j]), float(after.discrepancy[j]), floor, share, interval, tuple(steps),
                joint.name,
            )
        )  # fmt: skip
    return tuple(out)


def _locations(problem: ArticulatedProblem, base: ArticulatedFit) -> tuple[Location, ...]:
    """Joints by their share of what the nominal model leaves beyond the noise, its parameters re-estimated."""
    excess = np.maximum(base.chi2 - base.count, 0.0)
    total = float(excess.sum())
    out = []
    for j in np.argsort(-excess):
        share = float(excess[j] / total) if total > 0.0 else 0.0
        if share < problem.settings.articulated.shown:
            continue
        joint = problem.joints[int(j)]
        prepared = problem.records[0]
        channel = next(
            c.name
            for c in problem.case.channels
            if c.target == f"joint:{joint.name}" and c.quantity == "position"
        )
        innovation, _ = problem.innovations(int(j), (), base.vector, prepared)
        band, span = _gathered(
            innovation[:, 0],
            prepared.record.step,
            prepared.record.start,
            settings=problem.settings.articulated,
        )
        q, v = prepared.motion.position[:, j], prepared.motion.velocity[:, j]
        region = {
            "displacement": (float(q.min()), float(q.max())),
            "velocity": (float(v.min()), float(v.max())),
        }
        out.append(Location(channel, joint.name, share, band, span, region, kind="undetermined"))
    return tuple(out)


def _gathered(
    residual: Array, step: float, start: float, *, settings: ArticulatedSettings
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Band [Hz] and interval [s] that hold nine tenths of the power of a residual."""
    residual = np.nan_to_num(residual)
    power = np.abs(np.fft.rfft(residual)) ** 2
    frequency = np.asarray(np.fft.rfftfreq(len(residual), step), dtype=np.float64)
    time = np.asarray(start + step * np.arange(len(residual)), dtype=np.float64)

    def between(weights: Array, axis: Array) -> tuple[float, float]:
        total = np.cumsum(weights)
        low, high = np.searchsorted(total, np.array(settings.holds) * total[-1])
        return float(axis[min(low, len(axis) - 1)]), float(axis[min(high, len(axis) - 1)])

    return between(power, frequency), between(residual**2, time)


def _remainder(
    problem: ArticulatedProblem, final: ArticulatedFit, left: Prediction, untouched: Prediction
) -> dict[str, object]:
    j = int(np.argmax(final.reduced))
    innovation, _ = problem.innovations(
        j, final.hypothesis, final.vector, problem.motions(final.hypothesis, final.vector)[0]
    )
    band, span = _gathered(
        innovation[:, 0],
        problem.records[0].record.step,
        problem.records[0].record.start,
        settings=problem.settings.articulated,
    )
    return {
        "nrmse": float(left.discrepancy[j]),
        "over_noise": float(np.sqrt(final.reduced[j])),
        "of_before": float(left.discrepancy[j] / max(float(untouched.discrepancy[j]), 1e-12)),
        "channel": problem.joints[j].name,
        "band_hz": band,
        "time_s": span,
    }


def _nominal(problem: ArticulatedProblem, final: ArticulatedFit) -> tuple[NominalEstimate, ...]:
    deviations = np.sqrt(np.maximum(np.diag(final.covariance), 0.0))
    return tuple(
        NominalEstimate(p.name, p.value + p.std * float(x), p.std * float(s), p.value, p.std, float(x))
        for p, x, s in zip(problem.nominal, final.vector, deviations, strict=False)
    )


def _matrix(problem: ArticulatedProblem, fits: Sequence[ArticulatedFit]) -> dict[str, dict[str, float]]:
    base = next(f for f in fits if not f.hypothesis)
    out: dict[str, dict[str, float]] = {joint.name: {} for joint in problem.joints}
    for f in fits:
        if len(f.hypothesis) == 1:
            placed = f.hypothesis[0]
            before = float(np.maximum(base.chi2 - base.count, 1e-9)[placed.joint])
            after = float((f.chi2 - f.count)[placed.joint])
            share = float(np.clip(1.0 - after / before, 0.0, 1.0))
            mine = out[problem.joints[placed.joint].name]
            mine[placed.effect.name] = max(share, mine.get(placed.effect.name, 0.0))
    return out


__all__ = ["ArticulatedDiagnosis", "Hypothesis", "applies", "diagnose_articulated", "drives_only"]
