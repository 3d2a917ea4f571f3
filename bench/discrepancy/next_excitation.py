"""The next test: of a few feasible excitations, the one that separates the rival explanations best.

Two rivals are fitted to the same records; a new excitation separates them by as much as the second cannot imitate the
first when it is fitted again. To first order that is the part of the difference of their responses, in units of the
noise, orthogonal to the second's parameter sensitivities. Half its square is the expected log odds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.signal import chirp

from bench.discrepancy.attribute import names
from bench.discrepancy.case import CaseRecord, record_from_arrays
from bench.discrepancy.explain import Explanation
from bench.discrepancy.fit import Fit
from bench.discrepancy.problem import Array, Problem, whitened

LEVELS = (0.25, 1.0)
"""Peaks of the proposed loads as parts of the largest load of the records, taken as what the rig can do."""
REACH = 1.5
"""Largest proposed displacement, as a multiple of the largest one measured."""
DETECTABLE = 9.0
"""Expected log odds that count as a decision."""


def separate(problem: Problem, explanations: Sequence[Explanation]) -> dict[str, Any]:
    """Propose the excitation that separates the best explanation from its closest rival.

    Args:
        problem: Problem on all degrees of freedom.
        explanations: By decreasing posterior.

    Returns:
        Rivals, the excitation in words and numbers, its expected log odds, and those of repeating the present records;
        empty where there is no rival with another set of effects.
    """
    best = explanations[0]
    if problem.driven or len(best.parts) != 1:
        return {}
    keys = {p.key for p in best.hypothesis}
    rival = next((e for e in explanations[1:] if e.hypothesis and {p.key for p in e.hypothesis} - keys), None)
    if rival is None:
        return {}
    ((own, first),), ((_, second),) = best.parts, rival.parts
    template = max(problem.records, key=len)
    limit = max(float(np.abs(d.loads).max()) for d in problem.data)
    reach = REACH * max(float(np.abs(problem.motion(i).position).max()) for i in range(len(problem.records)))
    proposals = []
    for label, shape in _shapes(problem, template):
        for level in LEVELS:
            load = level * limit * shape
            record = record_from_arrays(
                label, template.time, {**template.values, **dict.fromkeys(own.structure.loads, load)}
            )
            separation, largest = _separation(own, first, second, record)
            if np.isfinite(separation) and largest <= reach:
                proposals.append((0.5 * separation, label, level * limit))
    if not proposals:
        return {}
    gain, label, peak = max(proposals)
    return {
        "separates": [names(best.hypothesis), names(rival.hypothesis)],
        "excitation": label,
        "peak_load": peak,
        "duration_s": len(template) * template.step,
        "expected_log_odds": gain,
        "log_odds_now": best.log_posterior - rival.log_posterior,
        "decides": bool(gain > DETECTABLE),
    }


def _shapes(problem: Problem, template: CaseRecord) -> list[tuple[str, Array]]:
    """Unit-peak candidate excitations on the clock of a record."""
    linear = problem.structure.at(problem.nominal)
    resonance = float(np.sqrt(max(linear.stiffness[0, 0] / linear.mass[0, 0], 0.0)) / (2.0 * np.pi))
    duration = len(template) * template.step
    centre = resonance if resonance > 2.0 / duration else 10.0 / duration
    t = template.time - template.start
    rise = np.minimum(t / (0.9 * duration), 1.0)
    noise = np.random.default_rng(0).standard_normal(len(t))
    spectrum = np.fft.rfft(noise)
    spectrum[np.fft.rfftfreq(len(t), template.step) > 3.0 * centre] = 0.0
    random = np.fft.irfft(spectrum, len(t))
    return [
        (f"slow sine at {0.2 * centre:.3g} Hz", np.sin(2 * np.pi * 0.2 * centre * t)),
        (f"sine at the resonance, {centre:.3g} Hz, growing from zero", rise * np.sin(2 * np.pi * centre * t)),
        (
            f"sweep from {0.3 * centre:.3g} to {2 * centre:.3g} Hz",
            chirp(t, 0.3 * centre, duration, 2 * centre),
        ),
        (f"random to {3 * centre:.3g} Hz", random / np.abs(random).max()),
        (
            "half-sine pulses of either sign",
            np.sign(np.sin(2 * np.pi * t / 5.0)) * np.maximum(np.sin(2 * np.pi * centre * t), 0),
        ),
    ]


def _separation(problem: Problem, first: Fit, second: Fit, record: CaseRecord) -> tuple[float, float]:
    """Squared distance that a refit of `second` cannot bridge, and the largest displacement under `first`."""
    a = problem.simulate(first.hypothesis, first.vector, record)
    b = problem.simulate(second.hypothesis, second.vector, record)
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return np.inf, np.inf
    data = problem.prepare(record, problem.nominal)
    difference = whitened(a - b, data)
    _, std, _, high = problem.prior(second.hypothesis)
    columns = []
    for i in range(len(second.vector)):
        step = 1e-3 * std[i] * (1.0 if second.vector[i] + 1e-3 * std[i] <= high[i] else -1.0)
        moved = second.vector.copy()
        moved[i] += step
        columns.append(whitened(problem.simulate(second.hypothesis, moved, record) - b, data) / step)
    matrix = np.column_stack(columns)
    root = np.linalg.cholesky(second.precision)
    basis, _ = np.linalg.qr(np.vstack([matrix, root.T]))
    full = np.concatenate([difference, np.zeros(len(root))])
    rest = full - basis @ (basis.T @ full)
    return float(rest @ rest), float(np.abs(a).max(axis=0)[0])
