"""What the residuals of a fit say of the logs, octave by octave: their likelihood where the scales of every joint are profiled out.

Residuals are compared as cosine transforms, whose ordinates are white where the residuals are. The power that a fit leaves in an octave,
over that of the stated noise, is ``r``. Up to what noise reaches by chance it is noise; what exceeds that, ``u``, is what the model is
wrong by. Noise has n independent ordinates. Model error has not: however finely it was logged, an octave and record hold a few samples of
it (`ErrorSettings.samples`), m in all. The mean square of both together is known as well as that of

    ν(u) = (1 + u)² / ((1 + 2 u) / n + u² / m)

independent residuals (the degrees of freedom of Satterthwaite), from n where nothing is missing down to m. Minus twice the profiled
log-likelihood has the slope ``ν / (1 + u)``, as that of ν residuals has, and is concave in the squares. Where noise explains the logs, all
samples count; between models that are both wrong, few do, and the priors of the nominal parameters hold against them.

References:
    P. Whittle, Estimation and information in stationary time series, Arkiv for Matematik 2 (1953) 423-434.
    F. E. Satterthwaite, An approximate distribution of estimates of variance components, Biometrics Bulletin 2 (1946) 110-114.
    J. W. Miller, D. B. Dunson, Robust Bayesian inference via coarsening, J. Am. Stat. Assoc. 114 (2019) 1113-1125.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from bench.arrays import Array
from bench.discrepancy.multibody.joint_record import JointRecord
from bench.discrepancy.multibody.records import PreparedRecord
from bench.discrepancy.settings import DiagnosisSettings


@dataclass(frozen=True, eq=False)
class Octaves:
    """The octaves of the residuals of all joints.

    Attributes:
        index: (n_joints,) of the octave (n,) of every residual, the highest frequencies first; what is below the last counts with it.
        count: (n_joints, n_octaves) independent ordinates of noise: of readings that stay the same in a row, about one.
        samples: Independent samples of what a model is wrong by, in an octave of all records.
        chance: Power over that of noise (n_joints, n_octaves) that noise reaches by chance.
    """

    index: tuple[NDArray[np.int64], ...]
    count: Array
    samples: float
    chance: Array

    @classmethod
    def of(cls, records: Sequence[PreparedRecord], settings: DiagnosisSettings) -> Octaves:
        """Octaves of records."""
        how = settings.articulated
        last = max(int(np.log2(max(len(r.record) for r in records) / how.octave)), 0)

        def octave_of(record: JointRecord) -> NDArray[np.int64]:
            k = np.arange(len(record.weight))
            octave = np.minimum(np.floor(-np.log2(np.maximum(k, 0.5) / len(k))), last)
            return np.repeat(octave.astype(np.int64), record.n_measured)

        n_joints = len(records[0].joints)
        index = tuple(np.concatenate([octave_of(r.joints[j]) for r in records]) for j in range(n_joints))
        n_octaves = 1 + max(int(octave.max()) for octave in index)

        def count_of(j: int) -> Array:
            # the transform of weighted white noise has the mean of the squared weights at every frequency
            weights = [r.joints[j].weight for r in records]
            each = np.concatenate([np.full(w.size, np.mean(w**2)) for w in weights])
            return np.asarray(np.bincount(index[j], weights=each, minlength=n_octaves), dtype=np.float64)

        count = np.array([count_of(j) for j in range(n_joints)])
        samples = settings.likelihood.error.samples * len(records)
        return cls(index, count, samples, 1.0 + how.judgement.sure * np.sqrt(2.0 / count))

    def power(self, j: int, residual: Array) -> Array:
        """Sums of squares (n_octaves,) of a residual (n,) of joint `j`."""
        powers = np.bincount(self.index[j], weights=residual**2, minlength=self.count.shape[1])
        return np.asarray(powers, dtype=np.float64)

    def misfit(self, j: int, power: Array) -> float:
        """Minus twice the profiled log-likelihood of joint `j` from the sums of squares (n_octaves,) of its residual."""
        n, r = self.count[j], power / self.count[j]
        u, m = np.maximum(r - self.chance[j], 0.0), np.minimum(self.samples, n)
        a, b, c = 1.0 / n, 2.0 / n, 1.0 / m
        # the integral of (1 + u) / (a + b u + c u^2); of as many samples as ordinates it is n ln (1 + u)
        root = np.sqrt(np.maximum(4.0 * a * c - b**2, 0.0))
        safe = np.where(root > 0.0, root, 1.0)
        angle = np.arctan((2.0 * c * u + b) / safe) - np.arctan(b / safe)
        rest = np.where(root > 0.0, (1.0 - b / (2.0 * c)) * 2.0 * angle / safe, 0.0)
        beyond = np.log1p((b * u + c * u**2) / a) / (2.0 * c) + rest
        return float(np.sum(n * np.minimum(r, self.chance[j]) + beyond))

    def scale(self, power: Array) -> Array:
        """Scales (n_joints, n_octaves), at least one, that give the squares the slopes of `misfit`; `power` of the same shape."""
        n = self.count
        u, m = np.maximum(power / n - self.chance, 0.0), np.minimum(self.samples, n)
        return np.asarray(np.sqrt((1.0 + 2.0 * u + u**2 * n / m) / (1.0 + u)))


def transformed(residuals: Sequence[Array]) -> Array:
    """Cosine transforms of residuals (n, k), all in one (n_residuals,), of the same sum of squares."""
    return np.concatenate([np.asarray(dct(r, axis=0, norm="ortho")).ravel() for r in residuals])


def log_likelihood(records: Sequence[PreparedRecord], octaves: Octaves, power: Array) -> float:
    """Log-likelihood of the logs up to a constant that no softness changes, from the (n_joints, n_octaves) sums of squares of a fit.

    The innovations' covariances count with their determinants: a gain that follows everything pays for it by innovations larger than
    the noise. All ordinates count on both sides.
    """
    whitened = sum(
        float(np.linalg.slogdet(joint.whitening)[1]) * float(np.sum(joint.weight**2)) / joint.n_measured
        for record in records
        for joint in record.joints
    )
    mean = power / octaves.count
    plain = octaves.count * (np.minimum(mean, 1.0) + np.log(np.maximum(mean, 1.0)))
    return whitened - 0.5 * float(np.sum(plain))
