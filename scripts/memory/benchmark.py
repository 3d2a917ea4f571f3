"""The Bouc-Wen benchmark of Noël and Schoukens (2016) as a black box: what is known is that one mass moves on a joint.

The joint is learned from the training multisine with its noise, five periods averaged: first by equation error, the mass along with
it, then by output error. Its resolution doubles until the residual on the training record is no more than 1.5 times the noise
that the scatter of the periods tells; neither test record plays a part in that. Loads are band-limited and are corrected for
being held over a step; the sweep's response passes the authors' decimation filter (see `bouc_wen_benchmark.py`).
"""

from __future__ import annotations

import time as clock
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.io import loadmat
from scipy.signal import firwin

from bench.arrays import Array
from bench.identification.memory import MemoryModel, MemorySettings, fit_memory
from bench.identification.memory_output_error import refine_in_rig
from bench.record_files.hdf5 import read_hdf5
from bench.recording import Recording
from bench.rig import Element, Rig, simulate
from bench.rig.library import sdof_rig
from memory.row import Progress, Row

RATE, PERIOD = 750.0, 8192
FINER = 4  # steps a sample while fitting
BAND = 300.0  # [Hz]; beyond it the differentiated displacement is noise
LEAD = PERIOD // 4  # samples before the period that is fitted: 2.7 s, in which the start is forgotten
LIMIT = 5e-6
"""Largest RMS error of the displacement on the test multisine [m]; published black boxes reach 7.5e-6."""
ENOUGH = 1.5
"""Residual over noise at which the resolution is enough."""
PROFILES = tuple(
    MemorySettings(
        form="profiles", slips=1, parts=parts, profile=profile, reach=0.8, cells=1, knots=2, substeps=1
    )
    for parts, profile in ((11, 6), (21, 12), (41, 24))
)
SLIDERS = (MemorySettings(form="sliders", slips=8, smallest=0.05, parts=7, cells=12, knots=5, substeps=1),)


class Data(NamedTuple):
    """Mean period of the training record, and the noise of that mean."""

    force: Array
    displacement: Array
    noise: float


def derivatives(x: Array, finer: int) -> Array:
    """A period (n,) band-limited, with its first two derivatives, at `finer` times the rate (3, n finer)."""
    spectrum, frequency = np.fft.rfft(x), np.fft.rfftfreq(len(x), 1.0 / RATE)
    padded = np.zeros((3, len(x) * finer // 2 + 1), dtype=complex)
    for order in range(3):
        padded[order, : len(spectrum)] = (
            spectrum * (frequency <= BAND) * (2j * np.pi * frequency) ** order * finer
        )
    return np.fft.irfft(padded, len(x) * finer, axis=1)


def resampled(x: Array, finer: int, *, held: bool = False) -> Array:
    """A period at `finer` times the rate; `held`: commands that, held over their steps, are the band-limited period."""
    spectrum, frequency = np.fft.rfft(x), np.fft.rfftfreq(len(x), 1.0 / RATE)
    if held:
        ratio = frequency / (RATE * finer)
        spectrum = spectrum / np.sinc(ratio) * np.exp(1j * np.pi * ratio)
    padded = np.zeros(len(x) * finer // 2 + 1, dtype=complex)
    padded[: len(spectrum)] = spectrum * finer
    return np.fft.irfft(padded, len(x) * finer)


def load(folder: Path) -> Data:
    """The training data."""
    wanted = [f"multisine/{name}" for name in "uy"]
    table = read_hdf5(folder / "train.h5", wanted.__contains__)
    u, y = (table[name].values[:, 0].reshape(-1, PERIOD) for name in wanted)
    noise = float(np.sqrt(np.mean(np.var(y, axis=0, ddof=1)) / len(y)))
    return Data(u.mean(axis=0), y.mean(axis=0), noise)


def learned(data: Data, settings: MemorySettings, progress: Progress) -> tuple[MemoryModel, Rig, float]:
    """The joint, the rig with it, and the residual on the training record [m]."""
    q, v, a = (np.tile(x, 2) for x in derivatives(data.displacement, FINER))
    force = np.tile(derivatives(data.force, FINER)[0], 2)
    rate = RATE * FINER
    model = fit_memory(
        np.stack([q, v], axis=1), force[:, None], time=np.arange(len(q)) / rate, accelerations=a[:, None],
        settle=PERIOD / RATE, settings=settings,
    )  # fmt: skip
    assert model.mass is not None
    element = Element(model.law, ("carriage",), model.theta, name="joint")
    rig = sdof_rig(element, mass=float(model.mass[0]), timestep=1.0 / rate)
    lead = LEAD * FINER
    arrays = {
        "shaker": resampled(data.force, FINER, held=True),
        "displacement": resampled(data.displacement, FINER),
    }
    arrays = {name: np.concatenate([x[-lead:], x]) for name, x in arrays.items()}
    units = {"shaker": "N", "displacement": "m"}
    record = Recording.from_arrays(None, arrays, units=units, sample_rate=rate, settle=LEAD / RATE)
    refined = refine_in_rig(
        model, rig, "joint", [record], structure=("structure/mass/carriage",), channels=("displacement",),
        max_iterations=20, progress=lambda i, cost: progress(f"output error, step {i}, cost {cost:.4g}"),
    )  # fmt: skip
    residual = float(np.sqrt(np.mean(refined.fit.residuals[0][record.scored] ** 2)))
    return refined.model, refined.fit.rig, residual


def multisine_error(rig: Rig, folder: Path) -> float:
    """RMS error on the steady period of the test multisine [m]."""
    u, y = (loadmat(folder / f"{n}.mat")[n].ravel() for n in ("uval_multisine", "yval_multisine"))
    finer = 2 * FINER
    command = np.tile(resampled(u, finer, held=True), 2)
    x = simulate(rig.with_(timestep=1.0 / (RATE * finer)), {"shaker": command})["displacement"]
    return float(np.sqrt(np.mean((x[::finer][-len(u) :] - y) ** 2)))


def enough(
    data: Data, levels: tuple[MemorySettings, ...], progress: Progress
) -> tuple[MemoryModel, Rig, float]:
    """What is learned at the first level whose residual is near the noise, or at the last."""
    for settings in levels[:-1]:
        found = learned(data, settings, progress)
        if found[2] <= ENOUGH * data.noise:
            return found
    return learned(data, levels[-1], progress)


def sweep_error(rig: Rig, folder: Path) -> float:
    """RMS error on the sine sweep, from rest [m]."""
    y = loadmat(folder / "yval_sinesweep.mat")["yval_sinesweep"].ravel()
    finer = 20  # the authors' own 15 kHz
    t = (np.arange(len(y) * finer) + 0.5) / (RATE * finer)
    command = 40.0 * np.sin(2.0 * np.pi * (18.0 * t + t**2 / 12.0))
    x = simulate(rig.with_(timestep=1.0 / (RATE * finer)), {"shaker": command})["displacement"]
    filtered = np.convolve(x, np.asarray(firwin(31, 1.0 / finer)), mode="same")[::finer]
    return float(np.sqrt(np.mean((filtered - y) ** 2)))


def rows(progress: Progress, folder: Path) -> list[Row]:
    """Rows of the task."""
    data, task = load(folder), "Bouc-Wen benchmark"
    found = [Row(task, "", "noise of the mean training period", data.noise, "m")]
    for label, levels in (("memory, profiles", PROFILES), ("memory, sliders", SLIDERS)):
        begun = clock.monotonic()
        model, rig, residual = enough(data, levels, lambda text, label=label: progress(f"{label}: {text}"))
        seconds = clock.monotonic() - begun
        mass = {name: value for kind, name, value in rig.structure if kind == "mass"}["carriage"]
        size = f"{model.report.n_parameters} parameters, mass {mass:.4f} kg"
        limit = LIMIT if label.endswith("profiles") else None
        found += [
            Row(task, label, "RMS residual on the training record", residual, "m", note=size),
            Row(task, label, "RMS error, test multisine", multisine_error(rig, folder), "m", limit),
            Row(task, label, "RMS error, sine sweep from rest", sweep_error(rig, folder), "m"),
            Row(task, label, "training time", seconds, "s", 300.0),
        ]
    return found
