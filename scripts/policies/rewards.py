"""How well rewards rank identification error: what each says of a record, beside the error that is left of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from bench.arrays import Array
from bench.excitation import Experiment, fans
from bench.excitation.background import SETTINGS, expected_error
from bench.excitation.contrastive import contrastive_bound, local_contrasts
from bench.excitation.information import INFORMATION_LIMITS
from envs.practice import PRACTICE_SETTINGS
from envs.setups import Setup

from .trials import Trial, trials_of

SCALES = tuple(3.0**-k for k in range(1, 7))
"""Narrowed priors of the local contrasts: from a third of the prior's deviation to less than what a gap's errors are."""
CONTRASTS, WIDE, TWINS = 8, 64, 4
"""Contrasts a scale, and from the whole prior; rigs with other backgrounds of which the scatter is told."""
RESAMPLES = 1000

REWARDS = {
    "information": "log det(I + F) at the rig, today's merit where it knows the rig",
    "information of draws": "the same averaged over the environments' prior draws, their default reward",
    "information, floored": "practice benches: -log of the expected error without a background, no less than a floor",
    "contrastive": "prior contrastive bound, 64 contrasts from the prior",
    "contrastive, local": "the sum of bounds with 8 contrasts from priors narrowed to 1/3, 1/9, ... 1/729",
    "contrastive, background": "the same; what the rig's background does to the record counts as noise",
    "spread of the estimate": "-log of the error that the least squares estimate states of itself",
    "expected error": "-log of the error that the least squares estimate is expected to have, the rig's background included",
}


class Weigher:
    """Says of tests what each reward would."""

    def __init__(self, setup: Setup, seed: int) -> None:
        self.setup, self.rng = setup, np.random.default_rng(seed)
        self.noise = np.array([setup.noise[name] for name in setup.station().channels])
        self.draws = setup.experiments[0]
        assert isinstance(self.draws, Experiment)

    def __call__(self, trial: Trial) -> dict[str, Array]:
        """Rewards of each rig's whole record ``(n,)``; those that look at measurements at the first repeat's."""
        kind, lengths = trial.kind, trial.runs[0].records.lengths
        p = kind.coordinates.shape[1]
        fine, _ = self._sums(trial, INFORMATION_LIMITS.step)
        left = np.trace(np.linalg.inv(np.eye(p) + fine), axis1=1, axis2=2) / p
        stated = np.linalg.inv(np.eye(p) + trial.found[0].information)
        return {
            "information": np.linalg.slogdet(np.eye(p) + fine)[1],
            "information of draws": np.array([self._merit(u, n) for u, n in zip(trial.controls, lengths, strict=True)]),
            "information, floored": -0.5 * np.log(left + PRACTICE_SETTINGS.floor**2),
            **self._contrastive(trial),
            "spread of the estimate": -0.5 * np.log(np.trace(stated, axis1=1, axis2=2) / p),
            "expected error": -np.log(expected_error(*self._sums(trial, SETTINGS.step))),
        }  # fmt: skip

    def _merit(self, controls: Array, length: int) -> float:
        return float(self.draws.merit(controls[None, :length])[0])

    def _sums(self, trial: Trial, step: float) -> tuple[Array, Array]:
        """Information ``(n, p, p)`` and score of the background ``(n, p)`` of each record, by differences of a step."""
        kind, lengths = trial.kind, trial.runs[0].records.lengths
        outputs = kind.family.record(fans(kind.coordinates, step), trial.controls)
        inside = np.arange(outputs.shape[2]) < lengths[:, None]
        outputs = np.where(inside[:, None, :, None], outputs / self.noise, 0.0)
        slopes = ((outputs[:, 1:] - outputs[:, :1]) / step).reshape(*outputs[:, 1:].shape[:2], -1)
        besides = np.where(inside[..., None], trial.runs[0].ideal / self.noise, 0.0) - outputs[:, 0]
        return slopes @ slopes.transpose(0, 2, 1), np.einsum(
            "npt,nt->np", slopes, besides.reshape(len(lengths), -1)
        )

    def _contrastive(self, trial: Trial) -> dict[str, Array]:
        kind, records = trial.kind, trial.runs[0].records
        family, x, bound = kind.family, kind.coordinates, np.sqrt(3.0)
        inside = (np.arange(records.measured.shape[1]) < records.lengths[:, None])[:, None, :, None]

        def likelihood(outputs: Array, variance: Array) -> Array:
            """Log-likelihoods ``(n, k)`` but for what is the same for all rigs."""
            square = np.where(inside, (records.measured[:, None] - outputs) ** 2 / variance, 0.0)
            total = -0.5 * square.sum(axis=(2, 3))
            return np.where(np.isfinite(total), total, -np.inf)

        wide = family.record(self.rng.uniform(-bound, bound, (len(x), WIDE, x.shape[1])), trial.controls)
        ladder = [
            family.record(local_contrasts(x, scale, CONTRASTS, self.rng), trial.controls) for scale in SCALES
        ]
        besides = self.rng.uniform(-bound, bound, (len(x), TWINS, kind.background.shape[1]))
        twins = np.concatenate([np.repeat(x[:, None], TWINS, axis=1), besides], axis=2)
        plain = family.record(x[:, None], trial.controls)
        scatter = np.mean((kind.real.record(twins, trial.controls) - plain) ** 2, axis=1, keepdims=True)
        white = np.broadcast_to(self.noise**2, plain.shape)
        exact = likelihood(trial.runs[0].ideal[:, None], white)[:, 0]
        loose = likelihood(plain, white + scatter)[:, 0]
        return {
            "contrastive": contrastive_bound(exact, likelihood(wide, white)),
            "contrastive, local": np.sum(
                [contrastive_bound(exact, likelihood(y, white)) for y in ladder], axis=0
            ),
            "contrastive, background": np.sum(
                [contrastive_bound(loose, likelihood(y, white + scatter)) for y in ladder], axis=0
            ),
        }


def study(
    setup: Setup, task: str, *, records: int, seed: int, tell: Callable[[str], None] = lambda text: None
) -> list[dict[str, Any]]:
    """One row a record: rig, excitation, errors and rewards.

    Args:
        setup: The laboratory.
        task: Its name.
        records: Records at least, each of rigs without and with a background.
        seed: Seed of rigs, noise and searches.
        tell: Called with what is done.
    """
    weigh = Weigher(setup, seed)
    rows = []
    for trial in trials_of(setup, task, records, seed, tell):
        said, errors = weigh(trial), trial.errors
        for i in range(errors.shape[1]):
            rows.append(
                {
                    "kind": trial.kind.family.hypothesis.name,
                    "rig": i,
                    "excitation": trial.method,
                    "background": trial.real,
                    "error": float(np.sqrt(np.mean(errors[:, i] ** 2))),
                    "error_once": float(errors[0, i]),
                    "rewards": {name: float(values[i]) for name, values in said.items()},
                }
            )
    return rows


def ranking(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Rank correlations of each reward with minus the error that is left, without a background, with one, and over both."""
    groups = {"without background": (False,), "with background": (True,), "both": (False, True)}
    return {
        where: {name: _row([r for r in rows if r["background"] in real], name) for name in REWARDS}
        for where, real in groups.items()
    }


def _row(rows: list[dict[str, Any]], name: str) -> dict[str, Any]:
    said = np.array([row["rewards"][name] for row in rows])
    error, once = (np.array([row[key] for row in rows]) for key in ("error", "error_once"))
    kinds = np.array([row["kind"] for row in rows])
    rigs = np.array([f"{row['kind']} {row['rig']}" for row in rows])
    rng, places = np.random.default_rng(0), [np.flatnonzero(rigs == rig) for rig in np.unique(rigs)]
    drawn = [
        np.concatenate([places[i] for i in rng.integers(len(places), size=len(places))])
        for _ in range(RESAMPLES)
    ]
    low, high = np.nanquantile([follows(said[at], error[at]) for at in drawn], [0.025, 0.975])
    return {
        "spearman": follows(said, error),
        "interval": [float(low), float(high)],
        "one measurement": follows(said, once),
        "within a rig": float(np.mean([follows(said[at], error[at]) for at in places])),
        "by kind": {str(kind): follows(said[kinds == kind], error[kinds == kind]) for kind in np.unique(kinds)},
        "records": len(rows),
    }  # fmt: skip


def follows(said: Array, error: Array) -> float:
    """Spearman's rank correlation of a reward with minus the error; 0 where one of them is the same for all."""
    if np.ptp(said) == 0.0 or np.ptp(error) == 0.0:
        return 0.0
    return -float(np.asarray(spearmanr(said, error).statistic))
