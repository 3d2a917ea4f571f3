"""The product that whitens a spectrum, compiled: small matrices, one a frequency, are where NumPy is slow."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _multiply(whitening, spectrum, out):
    n_bins, n_channels = spectrum.shape
    for k in range(n_bins):
        for i in range(n_channels):
            total = 0.0 + 0.0j
            # the inverse of a Cholesky factor is lower triangular
            for j in range(i + 1):
                total += whitening[k, i, j] * spectrum[k, j]
            out[0, k, i] = total.real
            out[1, k, i] = total.imag


def whiten(spectrum: NDArray[np.complex128], whitening: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Whiten a spectrum.

    Args:
        spectrum: (n_bins, n_channels).
        whitening: (n_bins, n_channels, n_channels), lower triangular.

    Returns:
        (2, n_bins, n_channels) real and imaginary parts.
    """
    out = np.empty((2, *spectrum.shape))
    _multiply(whitening, spectrum, out)
    return out
