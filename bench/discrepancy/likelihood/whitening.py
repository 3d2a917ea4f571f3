"""Records made ready for comparison: their band, the whitening of their residuals, their windows where they have any."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import fft

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.window_whitening import RestartWindows, orthonormal
from bench.discrepancy.numerics.spectral_product import whiten
from bench.discrepancy.settings import DEFAULT, LikelihoodSettings


class RecordData(NamedTuple):
    """One record, prepared for fits.

    Attributes:
        record: The record.
        loads: (n, n_loads).
        responses: (n, n_channels).
        n_bins: Number of frequency bins in the band.
        whitening: (n_bins, n_channels, n_channels) complex; whitening times the spectrum of the noise is white.
        windows: Windows that restart from the measured state; None where the whole record is one free run.
        compared: (n,) ones and zeros: samples that are compared; None for all.
        together: (k, k) what whitens the lower bins together, see `time_varying_noise`; None where every bin stands alone.
    """

    record: CaseRecord
    loads: Array
    responses: Array
    n_bins: int
    whitening: NDArray[np.complex128]
    windows: RestartWindows | None = None
    compared: Array | None = None
    together: Array | None = None


def fast_length(n: int) -> int:
    """FFT length for a record of `n` samples."""
    return int(fft.next_fast_len(n, real=True) or n)


def band_bins(responses: Array, noise: Array, *, settings: LikelihoodSettings = DEFAULT.likelihood) -> int:
    """Number of frequency bins up to where every response has sunk into its noise."""
    n = fast_length(len(responses))
    last = 32
    for c in range(responses.shape[1]):
        spectrum = np.abs(np.fft.rfft(responses[:, c], n)) ** 2 / len(responses)
        width = max(len(spectrum) // 200, 8)
        usable = len(spectrum) // width * width
        smooth = spectrum[:usable].reshape(-1, width).mean(axis=1)
        above = np.flatnonzero(smooth > settings.above_noise * noise[c] ** 2)
        if len(above):
            last = max(last, (above[-1] + 2) * width)
    return int(min(last, n // 2, settings.max_bins))


def timed(
    residual: Array, predicted: Array, noise: float, *, settings: LikelihoodSettings = DEFAULT.likelihood
) -> Array:
    """Residuals (n,) of one channel, limited where a predicted jump that comes a sample early or late explains them.

    Friction and stops make accelerations jump. The noise of the loads moves the time of a jump by microseconds; where a sample
    falls into them it is off by the whole jump, tens of standard deviations, and no parameter is to blame.

    Args:
        residual: Measured minus predicted.
        predicted: The free run.
        noise: Standard deviation of the channel's noise.
        settings: `LikelihoodSettings` of the diagnosis.
    """
    out = residual.copy()
    _excuse(residual, predicted, settings.jump_residual * noise, out)
    return out


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _excuse(residual, predicted, most, out):
    """Limit to `most` in `out` what a jump between two samples explains, that of the sample before first."""
    before = 0.0
    for k in range(2, len(predicted) - 1):
        jump = _jump(predicted, k, most) if k < len(predicted) - 3 else 0.0
        for reach in (-before, jump):
            part = residual[k] * np.sign(reach)
            if part > most and part < abs(reach) + most:
                out[k] = most * np.sign(reach)
                break
        before = jump


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _jump(predicted, k, most):
    """What the rise from sample k to the next is more than the median of four about it; zero where that is no jump."""
    rise = predicted[k + 1] - predicted[k]
    left, right = predicted[k] - predicted[k - 1], predicted[k + 2] - predicted[k + 1]
    far_left, far_right = predicted[k - 1] - predicted[k - 2], predicted[k + 3] - predicted[k + 2]
    least = min(left, right, far_left, far_right)
    largest = max(left, right, far_left, far_right)
    slope = 0.5 * (left + right + far_left + far_right - least - largest)
    around = max(abs(left - slope), abs(right - slope))
    return rise - slope if abs(rise - slope) > 2.0 * max(most, around) else 0.0


def whitened(residual: Array, data: RecordData) -> Array:
    """Whitened time-domain residuals (n, n_channels) over the band, as real numbers."""
    if data.windows is None:
        return whitened_spectrum(residual, data)
    white = data.windows.whitened(residual)
    return (white - (white @ data.windows.reachable) @ data.windows.reachable.T).ravel()


def reached(moved: Sequence[Array], data: RecordData, *, settings: LikelihoodSettings) -> list[Array]:
    """Orthonormal bases (n_rows, rank), one a window, of what other starts would change of the whitened residuals of a record.

    Args:
        moved: Change of the channels (n, n_channels) with each entry of the starts.
        data: The record, in windows.
        settings: `LikelihoodSettings` of the diagnosis.
    """
    assert data.windows is not None
    responses = np.stack([data.windows.whitened(change) for change in moved], axis=-1)
    return [orthonormal(columns, settings=settings) for columns in responses]


def projected(residual: Array, bases: Sequence[Array], data: RecordData) -> Array:
    """Whitened residuals of a record (n, n_channels), in windows without what other starts would have changed.

    Args:
        residual: Residuals.
        bases: Those of `reached`, where there are windows.
        data: The record.
    """
    if data.windows is None:
        return whitened(residual, data)
    white = data.windows.whitened(residual)
    for w, basis in enumerate(bases):
        white[w] -= basis @ (basis.T @ white[w])
    return white.ravel()


def without_bridged(compared: Array | None, record: CaseRecord) -> Array | None:
    """Samples (n,) that are compared, as ones and zeros, without those that a record was never measured at; None for all.

    Args:
        compared: The same without regard to them.
        record: The record.
    """
    if not record.bridged:
        return compared
    out = np.ones(len(record)) if compared is None else compared.copy()
    out[list(record.bridged)] = 0.0
    return out


def masked(samples: Array, compared: Array | None) -> Array:
    """Samples (n, k) of a record, those that are not compared set to zero, the others scaled to keep the power of white noise."""
    return samples if compared is None else samples * (compared / np.sqrt(compared.mean()))[:, None]


def whitened_spectrum(residual: Array, data: RecordData) -> Array:
    """Whitened spectrum of time-domain residuals (n, n_channels) of a whole record, real parts before imaginary ones."""
    n = len(residual)
    spectrum = fft.rfft(masked(residual, data.compared), fast_length(n), axis=0)[: data.n_bins] / np.sqrt(
        n / 2.0
    )
    white = whiten(spectrum, data.whitening)
    white[:, 0] /= np.sqrt(2.0)
    if data.together is not None:
        count = len(data.together) // (2 * spectrum.shape[1])
        lower = np.concatenate([spectrum[:count].real.ravel(), spectrum[:count].imag.ravel()])
        white[:, :count] = (data.together @ lower).reshape(2, count, -1)
    return white.ravel()
