"""The Bouc-Wen benchmark of Noël and Schoukens (2016), simulated by its authors; the nominal model knows no hysteresis.

The folder holds train.h5 (five periods of a random-phase multisine, 5 to 150 Hz, with noise) and the two test
records: one noise-free period of another multisine in its steady state, and a sine sweep of 20 to 50 Hz from rest.

What is known of the acquisition is stated in the case: the inputs are band-limited; the multisines are periodic; the sweep's
response was decimated from 15 kHz behind an FIR filter, whose droop `bouc_wen_benchmark.py` found to be that of 31 taps with a
Hamming window. The period-to-period scatter of the training record gives its noise, and the mean period is what is fitted.

References:
    J. P. Noël, M. Schoukens, Hysteretic benchmark with a dynamic nonlinearity, Workshop on Nonlinear System Identification
    Benchmarks, Brussels, 2016.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.data import (
    DATA_SETTINGS,
    bouc_wen_benchmark,
)
from bench.discrepancy import Case, CaseChannel, NominalParameter, record_from_arrays
from bench.discrepancy.case.acquisition import Antialias
from measured.target import Target

FOLDER = "bouc_wen_benchmark"
TARGET = Target("displacement", "rms", 5e-7, "m")
BAND = (5.0, 150.0)
"""Excited frequencies [Hz]."""
DECIMATION = Antialias("fir", cutoff_hz=375.0, rate_hz=15000.0, taps=31, records=("validation_sweep",))

NOMINAL = (
    NominalParameter("mass", 2.0, 0.02, "kg"),
    NominalParameter("damping", 10.0, 2.0, "N s/m"),
    NominalParameter("stiffness", 5e4, 2.5e3, "N/m"),
)
"""Linear part of the benchmark, with what a laboratory knows of such numbers: 1 % of a mass, 20 % of a damping, 5 % of a stiffness."""


def cases(data: Path) -> dict[str, Case]:
    """The benchmark as a case, from the folder of its files."""
    found = bouc_wen_benchmark(data)
    u, y = (
        found["train"][name].reshape(-1, DATA_SETTINGS.bouc_wen_period) for name in ("force", "displacement")
    )
    channels = (
        CaseChannel("force", "N", "measured", 0.0),
        CaseChannel("displacement", "m", "response", _noise(y), DECIMATION),
    )

    def record(name: str, force: np.ndarray, displacement: np.ndarray, *, periodic: bool):
        clock = np.arange(len(force)) / DATA_SETTINGS.bouc_wen_rate
        return record_from_arrays(
            name, clock, {"force": force, "displacement": displacement}, periodic=periodic
        )

    return {
        "bouc_wen": Case(
            "bouc_wen", "sdof", NOMINAL, channels,
            (record("identification", u.mean(axis=0), y.mean(axis=0), periodic=True),),
            (
                record("validation_multisine", found["multisine"]["force"], found["multisine"]["displacement"], periodic=True),
                record("validation_sweep", found["sweep"]["force"], found["sweep"]["displacement"], periodic=False),
            ),
            options={"load_interpolation": "band_limited"},
        )
    }  # fmt: skip


def _noise(periods: np.ndarray) -> float:
    """Noise of the mean of some periods (n_periods, n), as a white noise of the level it has where the response is.

    It falls towards half the sample rate, to half of that level; a mean over all frequencies would state it a tenth too small.
    """
    spectra = np.fft.rfft(periods, axis=1) / np.sqrt(periods.shape[1])
    frequency = np.fft.rfftfreq(periods.shape[1], 1.0 / DATA_SETTINGS.bouc_wen_rate)
    excited = (frequency >= BAND[0]) & (frequency <= BAND[1])
    return float(np.sqrt(np.mean(np.var(spectra, axis=0, ddof=1)[excited]) / len(periods)))
