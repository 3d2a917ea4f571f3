"""Faults planted in the records of a bench: how many `jointbench check` finds, and how often it cries at sound ones.

A slide of random mass, stiffness and damping, whose nominal model is off by its stated uncertainties, half of the time with an effect
missing (dry friction, a gap, a cubic spring), is measured and written as a case folder. Into each goes one fault; as many sound cases
are checked. A fault counts as found if the check does not say "ready"; a sound case that it does not call so is a false alarm.

    python scripts/planted_faults.py --faults 200 --sound 100 --json planted.json
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy.precheck.checking import check_folder
from bench.rig import Element, simulate
from bench.rig.library import sdof_rig
from bench.signals import BandLimitedNoise, Excitation

Columns = dict[str, np.ndarray]
RATE, DURATION = 250.0, 12.0


def measured(rng: np.random.Generator, peak: float = 30.0) -> tuple[dict[str, Columns], dict]:
    """Records by name and nominal.json of a sound case."""
    true: dict[str, Any] = {
        "mass": 2.0,
        "stiffness": rng.uniform(800.0, 3000.0),
        "damping": rng.uniform(3.0, 10.0),
    }
    std = {"mass": 0.02, "stiffness": 0.03, "damping": 0.2}
    hidden = [
        (),
        (),
        (Element.of("coulomb", "carriage", limit=0.08 * peak),),
        (Element.of("gap", "carriage", stiffness=0.5 * true["stiffness"], clearance=0.3 * peak / true["stiffness"]),),
    ]  # fmt: skip
    rig = sdof_rig(*hidden[int(rng.integers(len(hidden)))], **true, timestep=1e-3)
    drive = Excitation(
        {"shaker": BandLimitedNoise(cutoff=rng.uniform(6.0, 15.0), peak=peak)},
        duration=DURATION,
        sample_rate=1000.0,
    )
    records, noise = {}, {}
    for name in ("identification", "validation"):
        found = simulate(rig, drive, rng=np.random.default_rng(int(rng.integers(2**31))))
        take = slice(None, None, round(1000.0 / RATE))
        columns = {
            "time": np.array(found.time[take]),
            "force": np.array(found["shaker"][take]),
            "displacement": found["displacement"][take],
            "acceleration": found["acceleration_x"][take],
        }
        for channel in ("displacement", "acceleration"):
            noise.setdefault(channel, 0.005 * float(columns[channel].std()))
            columns[channel] = columns[channel] + noise[channel] * rng.standard_normal(len(columns[channel]))
        records[name] = columns
    nominal = {
        "rig": "sdof",
        "parameters": {
            name: {"value": value * (1.0 + std[name] * rng.standard_normal()), "std": std[name] * value}
            for name, value in true.items()
        },
        "channels": {
            "force": {"unit": "N", "role": "measured"},
            "displacement": {"unit": "m", "noise_std": noise["displacement"]},
            "acceleration": {"unit": "m/s^2", "noise_std": noise["acceleration"]},
        },
    }
    return records, nominal


def _torn(c: Columns, rng: np.random.Generator) -> None:
    """A cell of another row."""
    name = str(rng.choice(["force", "displacement", "acceleration"]))
    k = int(rng.integers(50, len(c["time"]) - 50))
    c[name][k] = c[name][k + int(rng.integers(25, 40))] * -1.0


def _clock(c: Columns, rng: np.random.Generator) -> None:
    """Rows that were lost, their times renumbered; or times in milliseconds."""
    if rng.random() < 0.5:
        c["time"] = 1000.0 * c["time"]
        return
    k, lost = int(rng.integers(200, 1200)), int(rng.integers(40, 200))
    for name in c:
        c[name] = np.delete(c[name], slice(k, k + lost))
    c["time"] = np.arange(len(c["time"])) / RATE


def _units(c: Columns, rng: np.random.Generator) -> None:
    """A column in another unit than its heading."""
    name, factor = [("displacement", 1000.0), ("displacement", 39.37), ("acceleration", 1.0 / 9.80665), ("force", 0.001)][
        int(rng.integers(4))
    ]  # fmt: skip
    c[name] = factor * c[name]


def _sign(c: Columns, rng: np.random.Generator) -> None:
    """A sensor or the load turned round."""
    name = str(rng.choice(["force", "displacement", "acceleration"]))
    c[name] = -c[name]


def _delay(c: Columns, rng: np.random.Generator) -> None:
    """A recorder that starts late: one response, or the load."""
    name, late = str(rng.choice(["force", "displacement", "acceleration"])), int(rng.integers(3, 12))
    c[name] = np.concatenate([np.full(late, c[name][0]), c[name][:-late]])


def _skew(c: Columns, rng: np.random.Generator) -> None:
    """A response on a clock that runs off by some milliseconds a second."""
    name, slope = (
        str(rng.choice(["displacement", "acceleration"])),
        rng.uniform(0.003, 0.01) * rng.choice([-1, 1]),
    )
    c[name] = np.interp(c["time"] * (1.0 + slope), c["time"], c[name])


def _saturation(c: Columns, rng: np.random.Generator) -> None:
    """A range that is too small."""
    name = str(rng.choice(["displacement", "acceleration"]))
    limit = rng.uniform(0.4, 0.65) * np.abs(c[name]).max()
    c[name] = np.clip(c[name], -limit, limit)


def _torque(c: Columns, rng: np.random.Generator) -> None:
    """A load that is something else: its magnitude, or a current before a gear."""
    c["force"] = np.abs(c["force"]) if rng.random() < 0.5 else c["force"] / rng.uniform(12.0, 100.0)


def _weak(c: Columns, rng: np.random.Generator) -> None:
    """Motion that hardly leaves the noise; see `main`."""


FAULTS: dict[str, Callable[[Columns, np.random.Generator], None]] = {
    "torn row": _torn, "clock": _clock, "unit": _units, "sign": _sign, "delay": _delay, "skew": _skew, "saturation": _saturation,
    "torque meaning": _torque, "weak excitation": _weak,
}  # fmt: skip


def check_one(fault: str, seed: int, folder: Path) -> tuple[str, float, tuple[str, ...]]:
    """Word, seconds and doubts of the check of a case with a fault; empty for a sound one."""
    rng = np.random.default_rng(seed)
    records, nominal = measured(rng)
    if fault == "weak excitation":
        factor = rng.uniform(0.001, 0.004)
        for columns in records.values():
            for name in ("force", "displacement", "acceleration"):
                clean = factor * columns[name]
                stated = nominal["channels"][name].get("noise_std", 0.0)
                columns[name] = clean + stated * rng.standard_normal(len(clean))
    elif fault:
        for columns in records.values():
            FAULTS[fault](columns, np.random.default_rng(seed + 1))
    folder.mkdir()
    (folder / "nominal.json").write_text(json.dumps(nominal))
    for name, columns in records.items():
        table = np.column_stack(list(columns.values()))
        np.savetxt(
            folder / f"{name}.csv", table, delimiter=",", header=",".join(columns), comments="", fmt="%.10g"
        )
    found = check_folder(folder)
    return found.word, found.seconds, found.doubts


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--faults", type=int, default=200)
    parser.add_argument("--sound", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    names = list(FAULTS)
    planned = [(names[k % len(names)], asked.seed + k) for k in range(asked.faults)]
    planned += [("", asked.seed + 100_000 + k) for k in range(asked.sound)]
    found: Counter[str] = Counter()
    total: Counter[str] = Counter()
    missed, seconds, begun = [], [], time.perf_counter()
    with tempfile.TemporaryDirectory() as root:
        for k, (fault, seed) in enumerate(planned):
            word, took, doubts = check_one(fault, seed, Path(root) / str(k))
            seconds.append(took)
            total[fault] += 1
            found[fault] += word != "ready"
            if (word != "ready") != bool(fault):
                missed.append({"fault": fault or "sound", "seed": seed, "doubts": list(doubts)})
    hits = sum(found[name] for name in names)
    result = {
        "found": {name: f"{found[name]}/{total[name]}" for name in names if total[name]},
        "found_share": hits / max(asked.faults, 1),
        "false_alarms": f"{found['']}/{total['']}",
        "median_seconds": float(np.median(seconds)),
        "longest_seconds": float(np.max(seconds)),
        "wrong": missed,
        "seconds": time.perf_counter() - begun,
    }
    text = json.dumps(result, indent=1)
    print(text)
    if asked.json is not None:
        asked.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
