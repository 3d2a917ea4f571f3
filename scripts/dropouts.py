"""Which thresholds tell samples that are missing under a clock numbered through: false alarms and hits over random records.

    python scripts/dropouts.py --n 40 --seed 0

Records of one or two degrees of freedom under noise, sweeps, multisines, steps and impacts, with and without a stop, a load switched
at random and noise of .1 to 3 %; of each, one as it is and others with 3, 10 or 30 samples taken out. A dropout counts as hit where a
place within two samples is told and no other. `bench.recording.jumps.JumpSettings` cites what this prints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import tyro
from scipy import signal

from bench.arrays import Array
from bench.recording.jumps import JUMPS, JumpSettings, hidden_dropouts

RATE, N = 500.0, 3000
LOST: tuple[int, ...] = (3, 10, 30)
KINDS = ("noise", "sweep", "multisine", "steps", "impacts")


@dataclass
class Args:
    """What is tried."""

    n: int = 40
    """Records of each kind of excitation."""
    seed: int = 0
    """Seed."""


def load_of(kind: str, rng: np.random.Generator) -> Array:
    """A load (N,) of one kind."""
    time = np.arange(N) / RATE
    if kind == "noise":
        sections = signal.butter(4, rng.uniform(10.0, 60.0), fs=RATE, output="sos")
        return np.asarray(signal.sosfilt(sections, rng.standard_normal(N)))
    if kind == "sweep":
        return np.asarray(signal.chirp(time, 1.0, time[-1], rng.uniform(10.0, 40.0)))
    if kind == "multisine":
        lines = rng.uniform(0.5, 30.0, 15)
        return np.sum([np.sin(2.0 * np.pi * f * time + rng.uniform(0.0, 6.3)) for f in lines], axis=0)
    if kind == "steps":
        return np.repeat(rng.standard_normal(10), N // 10)
    out = np.zeros(N)
    out[rng.choice(N - 10, 8)] = rng.uniform(5.0, 20.0, 8)
    return np.convolve(out, np.hanning(7), "same")


def record(kind: str, rng: np.random.Generator) -> Array:
    """Load, displacement and acceleration (N, 3) of a random specimen, with their noise."""
    load, stop = load_of(kind, rng), rng.random() < 0.3
    omega, damping = 2.0 * np.pi * rng.uniform(3.0, 20.0, 2), rng.uniform(0.005, 0.1)
    x, v, out, sub = np.zeros(2), np.zeros(2), np.empty((N, 2)), 4
    limit = rng.uniform(0.3, 1.0) / omega[0] ** 2
    for k in range(N):
        for _ in range(sub):
            force = np.array([load[k], 0.0]) - omega**2 * x - 2.0 * damping * omega * v
            force += 0.2 * omega[0] ** 2 * np.array([x[1] - x[0], x[0] - x[1]])
            if stop and x[0] > limit:
                force[0] -= 20.0 * omega[0] ** 2 * (x[0] - limit)
            v = v + force / (RATE * sub)
            x = x + v / (RATE * sub)
        out[k] = x[0], force[0]  # pyrefly: ignore[unbound-name]
    table = np.column_stack([load, out])
    level = rng.choice([1e-3, 1e-2, 3e-2])
    return np.asarray(table + level * table.std(axis=0) * rng.standard_normal(table.shape))


def main(args: Args) -> None:
    """Print, for each setting, false alarms and hits."""
    rng = np.random.default_rng(args.seed)
    whole = [record(kind, rng) for kind in KINDS for _ in range(args.n)]
    torn = []
    for table in whole:
        for lost in LOST:
            at = int(rng.integers(N // 4, 3 * N // 4))
            torn.append((lost, at, np.delete(table, slice(at, at + lost), axis=0)))
    print(
        "| clear | apart | false alarms | "
        + " | ".join(f"hits of {lost}" for lost in LOST)
        + " | wrong places |"
    )
    print("|---|---|---|" + "---|" * (len(LOST) + 1))
    tried = [replace(JUMPS, clear=clear) for clear in (3.0, 5.0, 8.0, 12.0)]
    tried += [replace(JUMPS, apart=apart) for apart in (1.2, 1.5, 3.0)]
    for settings in tried:
        print(_row(settings, whole, torn))


def _row(settings: JumpSettings, whole: list[Array], torn: list[tuple[int, int, Array]]) -> str:
    alarms = sum(bool(hidden_dropouts(table, settings)) for table in whole)
    hits: dict[int, int] = dict.fromkeys(LOST, 0)
    wrong = 0
    for lost, at, table in torn:
        told = hidden_dropouts(table, settings)
        hits[lost] += len(told) == 1 and abs(told[0] - at) <= 2
        wrong += any(abs(place - at) > 2 for place in told)
    shares = " | ".join(f"{100.0 * hits[lost] / len(whole):.1f} %" for lost in LOST)
    return f"| {settings.clear:g} | {settings.apart:g} | {alarms} of {len(whole)} | {shares} | {wrong} of {len(torn)} |"


if __name__ == "__main__":
    main(tyro.cli(Args))
