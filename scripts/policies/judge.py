"""Tests of methods and policies on held-out rigs, and what is identified from them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.excitation import (
    Family,
    PacedPlanner,
    PlanPolicy,
    Policy,
    RigPrior,
    RivalPlanner,
    Rivals,
)
from bench.excitation.closed_loop import Runs, disturbances, run_commands, run_policy
from bench.excitation.estimation import Records, estimate
from bench.excitation.paced import SETTINGS as PACED_SETTINGS
from bench.excitation.planner import Planner
from bench.excitation.stepping import Packed
from envs.setups import Setup

HELD_OUT = 7_000_000  # seeds of rigs and noise; no training draws from them

CERTAIN = float(np.log(99.0))

TIMES = (*np.arange(0.1, 1.95, 0.1), *np.arange(2.0, 3.0, 0.25), *np.arange(3.0, 8.25, 0.5))
"""Times at which rivals are judged, as parts of an eighth of the test."""


def hidden(setup: Setup, seed: int, rigs: int) -> Iterator[tuple[int, str, NDArray[np.float64], Any]]:
    """Held-out rigs of a seed by question and kind: question, kind, coordinates ``(m, p)``, hypothesis."""
    rng = np.random.default_rng(HELD_OUT + seed)
    kinds = [
        (i, h)
        for i, question in enumerate(setup.questions)
        for h in (
            question.hypotheses if isinstance(question, RigPrior) else (question.first, question.second)
        )
    ]
    for k, (i, hypothesis) in enumerate(kinds):
        count = rigs // len(kinds) + (k < rigs % len(kinds))
        yield (
            i,
            hypothesis.name,
            rng.uniform(-np.sqrt(3.0), np.sqrt(3.0), (count, len(hypothesis.parameters))),
            hypothesis,
        )


Source = Policy | PlanPolicy | PacedPlanner | Planner | list[RivalPlanner] | list[NDArray[np.float64]]


class Judge:
    """Runs tests on held-out rigs and identifies them."""

    def __init__(self, setup: Setup) -> None:
        self.setup, self.station = setup, setup.station()
        self.noise = np.array(list(setup.noise.values()))
        self._families: dict[int, Family] = {}

    def family(self, hypothesis: Any) -> Family:
        """The rigs of a hypothesis."""
        if id(hypothesis) not in self._families:
            self._families[id(hypothesis)] = Family(hypothesis, self.station.channels, self.station.actuators)
        return self._families[id(hypothesis)]

    def rows(self, source: Source, seed: int, rigs: int) -> list[dict[str, Any]]:
        """One row a rig."""
        result = []
        for question, kind, coordinates, hypothesis in hidden(self.setup, seed, rigs):
            if not len(coordinates):
                continue
            family = self.family(hypothesis)
            rng = np.random.default_rng([HELD_OUT + seed, question])
            noise = disturbances(self.station, len(coordinates), rng)
            packed = family.packed(coordinates)
            runs = self._run(source, question, packed, noise, seed)
            asked = self.setup.questions[question]
            found = (
                self._seconds(asked, hypothesis, runs)
                if isinstance(asked, Rivals)
                else self._error(family, coordinates, runs)
            )
            for i, figures in enumerate(found):
                result.append(
                    {
                        "seed": seed,
                        "question": asked.name if isinstance(asked, Rivals) else "",
                        "kind": kind,
                        "violations": int(runs.violations[i]),
                        "windows": int(runs.windows[i]),
                        "stroke": float(runs.reached[i, 0]),
                        "energy": float(runs.energy[i]),
                        **figures,
                    }
                )
        return result

    def _run(
        self, source: Source, question: int, packed: Packed, noise: NDArray[np.float64], seed: int
    ) -> Runs:
        """Tests on rigs of which a question is asked."""
        if isinstance(source, Planner):
            return source.run(packed, noise, seed=seed)
        if not isinstance(source, list):
            return run_policy(source, packed, noise, question=question)
        own = source[question]
        if isinstance(own, RivalPlanner):
            return own.run(packed, noise, seed=seed)
        return run_commands(self.station, own, packed, noise)

    def _error(self, family: Family, truth: NDArray[np.float64], runs: Runs) -> list[dict[str, Any]]:
        found = estimate(family, runs.records, self.noise)
        off = found.coordinates - truth
        names = family.hypothesis.names
        return [
            {
                "error": float(np.sqrt(np.mean(row**2))),
                **{f"error of {name}": float(abs(x)) for name, x in zip(names, row, strict=True)},
            }
            for row in off
        ]

    def _seconds(self, rivals: Rivals, truth: Any, runs: Runs) -> list[dict[str, Any]]:
        """Time to certainty [s]; the whole test where the truth never became certain, or the other did first."""
        m, timestep = len(runs.windows), self.station.timestep
        families = [self.family(h) for h in (rivals.first, rivals.second)]
        sign = 1.0 if truth is rivals.first else -1.0
        seconds, wrong = np.full(m, self.station.duration), np.zeros(m, dtype=bool)
        open_ones = np.arange(m)
        near: list[NDArray[np.float64] | None] = [None, None]
        for part in TIMES:
            n = round(part / 8.0 * self.station.n_samples)
            if not open_ones.size:
                break
            all_records = runs.records
            some = Records(
                all_records.controls[open_ones, :n],
                all_records.measured[open_ones, :n],
                np.minimum(all_records.lengths[open_ones], n),
            )
            found = [
                estimate(f, some, self.noise, near=start, candidates=64, kept=2)
                for f, start in zip(families, near, strict=True)
            ]
            odds = sign * (found[0].log_evidence - found[1].log_evidence)
            sure, fooled = odds >= CERTAIN, odds <= -CERTAIN
            seconds[open_ones[sure]] = n * timestep
            wrong[open_ones[fooled]] = True
            ended = (
                runs.records.lengths[open_ones] <= n
            )  # a limit switch ended the record: nothing more to come
            stay = ~(sure | fooled | ended)
            near = [item.coordinates[stay] for item in found]
            open_ones = open_ones[stay]
        return [{"seconds": float(s), "wrong": bool(w)} for s, w in zip(seconds, wrong, strict=True)]


def fingerprint(source: Source) -> str:
    """Of a policy's numbers, a planner's settings or commands, so that a partial result belongs to what it was made with."""
    import hashlib

    if isinstance(source, Policy):
        arrays = [*source.weights, *source.biases, source.mean, source.deviation, source.schedule]
        if source.recurrence is not None:
            arrays += [source.recurrence.input, source.recurrence.hidden, source.recurrence.bias]
    elif isinstance(source, PlanPolicy):
        arrays = [source.opening]
        for stage in source.stages:
            arrays += [np.array(stage.window), stage.plans, *stage.weights, *stage.biases]
    elif isinstance(source, Planner):
        arrays = [source.opening, np.array([*source.decisions, source.generations])]
    elif isinstance(source, PacedPlanner):
        arrays = [source.opening, np.frombuffer(str(PACED_SETTINGS).encode(), dtype=np.uint8)]
    elif isinstance(source[0], RivalPlanner):
        first = source[0]
        settings = (first.interval, first.horizon, first.knot, first.generations, first.samples)
        arrays = [np.array([*settings, *(len(planner.draws) for planner in source)])]
    else:
        arrays = source
    judged = [*arrays, np.array(TIMES)]
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in judged)).hexdigest()[:12]
