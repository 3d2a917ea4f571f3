"""Why records say too little, in words: what the motion reached, and what would have shown there."""

from __future__ import annotations

import numpy as np

from bench.discrepancy.effects.effect import unit_of
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.search.explanation import Explanation

LIMITS = {"clearance": "gap", "position": "stop"}


def why_alike(simulator: Simulator, first: Explanation, second: Explanation) -> str:
    """Say why the records of a problem do not tell two explanations apart."""
    parts = [
        f"With these records {names(first.hypothesis)} and {names(second.hypothesis)} predict nearly the same."
    ]
    for explanation in (first, second):
        for part, fitted in explanation.parts:
            _, etas = part.split(fitted.hypothesis, fitted.vector)
            for placed, eta in zip(fitted.hypothesis, etas, strict=True):
                said = _reached(simulator, part, placed, eta)
                if said and said not in parts:
                    parts.append(said)
    parts.append(_difference(simulator, first, second))
    return " ".join(part for part in parts if part)


def _reached(simulator: Simulator, part: Problem, placed: Placed, eta: Array) -> str:
    """What the motion reached of an effect with a threshold; empty where it went well beyond."""
    if placed.effect.site != "joint" or len(placed.place.rows) != 1:
        return ""
    scales = part.scales_of(placed)
    unit = placed.place.position_unit
    title = placed.effect.name.replace("_", " ") + (f" ({placed.place.name})" if placed.place.name else "")
    values = dict(
        zip((p.name for p in placed.effect.parameters), placed.effect.values(eta, scales), strict=True)
    )
    for name, what in LIMITS.items():
        if name not in values:
            continue
        limit, largest = abs(values[name]), scales.position
        share = _beyond(simulator, placed, limit)
        if limit > largest:
            return f"The motion never left the {what} of the {title}: its largest displacement is {largest:.3g} {unit}."
        if limit > simulator.settings.next_test.barely * largest:
            return (
                f"The motion hardly left the {what} of the {title}: largest displacement {largest:.3g} {unit}, "
                f"{what} at {limit:.3g} {unit}, {100 * share:.2g} % of the time beyond it."
            )
        if limit < 0.05 * largest:
            return (
                f"The motion is so much larger ({largest:.3g} {unit}) than the {what} of the {title} ({limit:.2g} {unit}) "
                "that what happens inside it hardly shows."
            )
    for parameter in placed.effect.parameters:
        if parameter.scale == "velocity" and values[parameter.name] > scales.velocity:
            return (
                f"The largest velocity, {scales.velocity:.3g} {unit}/s, stays below the {parameter.name.replace('_', ' ')} of the "
                f"{title} ({values[parameter.name]:.3g} {unit}/s)."
            )
    return ""


def _beyond(simulator: Simulator, placed: Placed, limit: float) -> float:
    """Part of the time that the motion of a place spends beyond a displacement."""
    samples = [simulator.motion(i).position @ _row(simulator, placed) for i in range(len(simulator.records))]
    return float(np.mean(np.abs(np.concatenate(samples)) > limit))


def _row(simulator: Simulator, placed: Placed) -> Array:
    return next(p for p in simulator.structure.places if p.name == placed.place.name).rows[0]


def _difference(simulator: Simulator, first: Explanation, second: Explanation) -> str:
    """The largest difference of two explanations' responses, held against the noise."""
    worst: tuple[float, str, float] | None = None
    for record in simulator.records:
        a, b = first.predict(record), second.predict(record)
        for c, name in enumerate(simulator.structure.channels):
            if not (np.isfinite(a[name]).all() and np.isfinite(b[name]).all()):
                continue
            difference = float(np.sqrt(np.mean((a[name] - b[name]) ** 2)))
            entry = (difference / simulator.noise[c], name, difference)
            worst = entry if worst is None or entry > worst else worst
    if worst is None:
        return ""
    ratio, name, difference = worst
    unit = simulator.case.channel(name).unit
    return f"Their responses differ most in {name}, by {difference:.3g} {unit} rms, {ratio:.2g} times the noise of a sample."


def sensitivity(problem: Problem, candidates: list[Placed]) -> dict[tuple[str, str], float]:
    """Smallest RMS force of effects that would have shown in the records, as a part of the RMS load.

    Every effect is added to the nominal model with a small force, and the change of the whitened response that no deviation of
    the nominal parameters within their uncertainty makes up is measured.

    Args:
        problem: Records and priors.
        candidates: Forces at places.

    Returns:
        By (effect, place); infinite where an effect would not show however strong, since the motion never met it.
    """
    settings = problem.settings.next_test
    n = len(problem.nominal)
    base = problem.residual((), np.zeros(n))
    columns = np.column_stack([(problem.residual((), 0.1 * np.eye(n)[i]) - base) / 0.1 for i in range(n)])
    basis, _ = np.linalg.qr(np.vstack([columns, np.eye(n)]))
    out = {}
    for placed in candidates:
        effect = placed.effect
        eta = effect.grid()[len(effect.grid()) // 2].copy()
        amplitude = settings.probe if effect.parameters[0].signed else np.log(settings.probe)
        eta[0] = amplitude
        changed = problem.residual((placed,), np.concatenate([np.zeros(n), eta]))
        if not np.isfinite(changed).all():
            continue
        full = np.concatenate([changed - base, np.zeros(n)])
        rest = full - basis @ (basis.T @ full)
        gain = float(rest @ rest)
        out[(effect.name, placed.place.name)] = (
            settings.probe * np.sqrt(settings.detectable / gain) if gain > 0.0 else np.inf
        )
    return out


def why_none(problem: Problem, candidates: list[Placed]) -> str:
    """Say how much could still be missing where the records call for nothing.

    Args:
        problem: Records and priors.
        candidates: Forces at places that are worth mentioning.
    """
    settings = problem.settings.next_test
    found = sensitivity(problem, candidates)
    if not found:
        return ""
    sentences = []
    for place in {p.place.name: p.place for p in candidates}.values():
        index = next(i for i, p in enumerate(candidates) if p.place.name == place.name)
        scales = problem.scales_of(candidates[index])
        unit = unit_of("position", place.position_unit, place.force_unit)
        where = f" on the {place.name} axis" if place.name else ""
        own = {name: value for (name, at), value in found.items() if at == place.name}
        seen = sorted((value, name) for name, value in own.items() if value <= settings.insensitive)
        unseen = sorted(name.replace("_", " ") for name, value in own.items() if value > settings.insensitive)
        if seen:
            largest, name = seen[-1]
            sentences.append(
                f"An effect{where} with a force above {100 * largest:.2g} % of the RMS load would have shown"
                f" ({name.replace('_', ' ')} is the hardest to see)."
            )
        if unseen:
            sentences.append(
                f"The records say little about {', '.join(unseen)}{where}: even a force of {100 * settings.insensitive:.0f} % of the RMS "
                "load would be lost in the noise or taken for a nominal parameter."
            )
        sentences.append(
            f"A gap or a stop beyond the largest displacement{where}, {scales.position:.3g} {unit}, could not show."
        )
    return " ".join(sentences)
