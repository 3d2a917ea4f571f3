"""Faults planted in the records of a bench: how many `jointbench check` finds, and how often it cries at sound ones.

A machine whose nominal model is off by its stated uncertainties, half of the time with an effect missing, is measured and written as a
case folder: a slide of the bench (dry friction, a gap, a cubic spring), the same slide as the user's own MJCF, or an arm of two joints on
servos (dry friction, a delay). Into each goes one fault; as many sound cases are checked. A fault counts as found if the check does not
say "ready"; a sound case that it does not call so is a false alarm.

    python scripts/planted_faults.py --faults 200 --sound 100 --json planted.json
    python scripts/planted_faults.py --machine arm --faults 80 --sound 40
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from planted_machines import MACHINES, Columns, Machine

from bench.discrepancy.precheck.checking import check_folder


def _torn(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """A cell of another row."""
    name = str(rng.choice([*m.loads, *m.responses]))
    k = int(rng.integers(50, len(c["time"]) - 50))
    c[name][k] = c[name][k + int(rng.integers(25, 40))] * -1.0


def _clock(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """Rows that were lost, their times renumbered; or times in milliseconds."""
    if rng.random() < 0.5:
        c["time"] = 1000.0 * c["time"]
        return
    n, step = len(c["time"]), float(c["time"][1])
    k, lost = int(rng.integers(n // 15, 2 * n // 5)), int(rng.integers(n // 75, n // 15))
    for name in c:
        c[name] = np.delete(c[name], slice(k, k + lost))
    c["time"] = np.arange(len(c["time"])) * step


def _units(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """A column in another unit than its heading."""
    name, factor = m.units[int(rng.integers(len(m.units)))]
    c[name] = factor * c[name]


def _sign(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """A sensor or the load turned round."""
    name = str(rng.choice([*m.loads, *m.responses]))
    c[name] = -c[name]


def _delay(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """A recorder that starts late: one response, or the load."""
    name, late = str(rng.choice([*m.loads, *m.responses])), int(rng.integers(3, 12))
    c[name] = np.concatenate([np.full(late, c[name][0]), c[name][:-late]])


def _skew(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """A response on a clock that runs off by some milliseconds a second."""
    name, slope = str(rng.choice(m.responses)), rng.uniform(0.003, 0.01) * rng.choice([-1, 1])
    c[name] = np.interp(c["time"] * (1.0 + slope), c["time"], c[name])


def _saturation(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """A range that is too small."""
    name = str(rng.choice(m.responses))
    limit = rng.uniform(0.4, 0.65) * np.abs(c[name]).max()
    c[name] = np.clip(c[name], -limit, limit)


def _meaning(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """A load that is something else."""
    name = str(rng.choice(m.loads))
    c[name] = m.wrong(c[name], rng)


def _weak(m: Machine, c: Columns, rng: np.random.Generator) -> None:
    """Motion that hardly leaves the noise; see `check_one`."""


FAULTS: dict[str, Callable[[Machine, Columns, np.random.Generator], None]] = {
    "torn row": _torn, "clock": _clock, "unit": _units, "sign": _sign, "delay": _delay, "skew": _skew, "saturation": _saturation,
    "torque meaning": _meaning, "weak excitation": _weak,
}  # fmt: skip


def check_one(
    fault: str, seed: int, folder: Path, machine: str = "slide"
) -> tuple[str, float, tuple[str, ...]]:
    """Word, seconds and doubts of the check of a case with a fault; empty for a sound one."""
    chosen, rng = MACHINES[machine], np.random.default_rng(seed)
    records, nominal, model = chosen.measured(rng)
    if fault == "weak excitation":
        factor = rng.uniform(0.001, 0.004)
        for columns in records.values():
            for name in (*chosen.loads, *chosen.responses):
                clean = factor * columns[name]
                stated = nominal["channels"][name].get("noise_std", 0.0)
                columns[name] = clean + stated * rng.standard_normal(len(clean))
    elif fault:
        for columns in records.values():
            FAULTS[fault](chosen, columns, np.random.default_rng(seed + 1))
    folder.mkdir()
    (folder / "nominal.json").write_text(json.dumps(nominal))
    if model:
        (folder / "model.xml").write_text(model)
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
    parser.add_argument("--machine", choices=MACHINES, default="slide")
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
            word, took, doubts = check_one(fault, seed, Path(root) / str(k), asked.machine)
            seconds.append(took)
            total[fault] += 1
            found[fault] += word != "ready"
            if (word != "ready") != bool(fault):
                missed.append({"fault": fault or "sound", "seed": seed, "doubts": list(doubts)})
    hits = sum(found[name] for name in names)
    result = {
        "machine": asked.machine,
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
