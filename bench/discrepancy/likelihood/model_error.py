"""The error of a model that is wrong in small ways: its spectrum, and how many independent samples of it there are.

A measured rig leaves more than sensor noise: what nobody modelled is correlated, depends on the excitation, and is far larger. Its
spectrum ``S`` is profiled, channel by channel and record by record: what a reference explanation leaves, smoothed over a part of an
octave, and never below the stated noise nor below `ErrorSettings.least` of the response. Residuals are whitened by it. A band of
model error is no crowd of independent samples, however finely it was sampled, but a few: the log-likelihood is a power of the plain
one (a coarsened posterior), each residual counted with the weight that leaves `ErrorSettings.samples` of them an octave and record,
channels together, since one missing force moves them all. Reduced chi-squared is of order one for the reference by construction, and no
parameter is known better than so many samples tell.

References:
    M. C. Kennedy, A. O'Hagan, Bayesian calibration of computer models, J. R. Stat. Soc. B 63 (2001) 425-464.
    J. Brynjarsdottir, A. O'Hagan, Learning about physical parameters: the importance of model discrepancy, Inverse Problems 30 (2014).
    J. W. Miller, D. B. Dunson, Robust Bayesian inference via coarsening, J. Am. Stat. Assoc. 114 (2019) 1113-1125.
    P. Gruenwald, T. van Ommen, Inconsistency of Bayesian inference for misspecified linear models, Bayesian Analysis 12 (2017).
    L. Ljung, Model validation and model error modeling, 1999 (the spectrum of what a model leaves).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, Prediction
from bench.discrepancy.likelihood.whitening import RecordData, fast_length, masked
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.settings import DEFAULT, ErrorSettings


@dataclass(frozen=True, eq=False)
class ModelInadequacy:
    """Error of a model on some records.

    Attributes:
        power: (record, channel) to the variance (n_bins,) of its spectrum, in the units of `RecordData.whitening`.
        scale: Of records in windows: their residual power over that of their noise.
        together: Channels that one missing force moves together.
        crude: Whether it is a guess that nothing has been fitted for.
        settings: How it was estimated.
    """

    power: Mapping[tuple[str, str], Array]
    scale: float = 1.0
    together: float = 1.0
    crude: bool = False
    settings: ErrorSettings = DEFAULT.likelihood.error

    def of(self, record: str, channels: Sequence[str], n_bins: int) -> Array:
        """Variance (n_bins, n_channels) in a record; the last value beyond the bins that it was estimated for, zero where it was not."""
        out = np.zeros((n_bins, len(channels)))
        for c, name in enumerate(channels):
            known = self.power.get((record, name), np.zeros(1))
            out[:, c] = np.append(known, np.full(max(n_bins - len(known), 0), known[-1]))[:n_bins]
        return out

    def weights(self, n_bins: int) -> Array:
        """How much each residual of a frequency counts (n_bins,), at most one."""
        return band_weights(n_bins, self.settings.samples / (2.0 * self.together))

    def window_weight(self, n_residuals: int) -> float:
        """How much each residual of a record in windows counts: as many samples as `weights` leaves of a whole record."""
        return min(1.0, self.settings.record_octaves * self.settings.samples / max(n_residuals, 1))


def band_weights(n_bins: int, samples: float) -> Array:
    """Weights (n_bins,) that leave so many samples of the bins of each octave."""
    octave = np.floor(np.log2(np.maximum(np.arange(n_bins), 1))).astype(np.int64)
    counts = np.bincount(octave)
    # the last octave may be cut short, and holds its part of samples then
    counts[-1] = max(counts[-1], 2 ** (len(counts) - 1))
    return np.minimum(1.0, samples / counts[octave])


def smoothed(power: Array, settings: ErrorSettings = DEFAULT.likelihood.error) -> Array:
    """Mean of a spectrum (n_bins, k) over a part of an octave about each bin."""
    n = len(power)
    bins = np.arange(n)
    reach = np.maximum(bins * (2.0 ** (0.5 * settings.octaves) - 1.0), settings.bins).astype(np.int64)
    low, high = np.maximum(bins - reach, 0), np.minimum(bins + reach + 1, n)
    total = np.vstack([np.zeros((1, power.shape[1])), np.cumsum(power, axis=0)])
    return (total[high] - total[low]) / (high - low)[:, None]


def spectral_power(samples: Array, n_bins: int, compared: Array | None = None) -> Array:
    """Power (n_bins, k) of samples (n, k), so normalised that white noise has its variance everywhere."""
    n = len(samples)
    spectrum = np.fft.rfft(masked(samples, compared), fast_length(n), axis=0)[:n_bins]
    return np.abs(spectrum) ** 2 / n


def own_noise(data: RecordData) -> Array:
    """Variance (n_bins, n_channels) of the noise that a record is whitened by."""
    factor = np.linalg.inv(data.whitening)
    return np.asarray(np.sum(np.abs(factor) ** 2, axis=2), dtype=np.float64)


def error_left(
    data: Sequence[RecordData],
    structure: Structure,
    predict: Prediction,
    settings: ErrorSettings = DEFAULT.likelihood.error,
) -> ModelInadequacy:
    """Error of the model that an explanation leaves.

    Args:
        data: Records, whitened by their noise.
        structure: Of all degrees of freedom.
        predict: The explanation's free run; a record on which it diverged counts as not predicted at all.
        settings: How it is estimated.
    """
    power, channels = {}, structure.channels
    for entry in data:
        predicted = predict(entry.record)
        left = np.column_stack([entry.record.values[name] - predicted[name] for name in channels])
        if not np.isfinite(left).all():
            left = entry.responses
        found = smoothed(spectral_power(left, entry.n_bins, entry.compared), settings)
        response = smoothed(spectral_power(entry.responses, entry.n_bins, entry.compared), settings)
        beyond = np.maximum(found - own_noise(entry), settings.least**2 * response)
        power.update({(entry.record.name, name): beyond[:, c] for c, name in enumerate(channels)})
    return ModelInadequacy(power, together=_together(structure), settings=settings)


def crude_error(
    case: Case, structure: Structure, settings: ErrorSettings = DEFAULT.likelihood.error
) -> ModelInadequacy:
    """Error of a model of which nothing is known yet: white, a part of each channel."""
    level = {
        (record.name, name): (settings.crude * float(np.std(record.values[name]))) ** 2
        for record in case.identification
        for name in structure.channels
    }
    power = {key: np.array([value]) for key, value in level.items()}
    return ModelInadequacy(power, together=_together(structure), crude=True, settings=settings)


def _together(structure: Structure) -> float:
    return len(structure.channels) / len(structure.groups())
