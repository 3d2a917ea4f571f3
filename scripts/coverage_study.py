"""What records make a reduced-order joint that generalises: table and figure of docs/coverage.md.

    python scripts/coverage_study.py                 prints the table
    python scripts/coverage_study.py --docs docs     writes coverage_table.md and pictures/coverage.png as well

The laboratory joint with the friction of its universal joints (C3) is identified from sets of records of equal length, with the same
sensors and within the same peak loads, as a joint with memory, a network and a bounded polynomial. Each model then takes the joint's
place under loads that no set holds; what counts is the worse of the two forces' errors under each.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from matplotlib.figure import Figure
from memory.record_sets import SETTINGS as SETS
from memory.record_sets import drive, peaks, sets
from memory.two_axes import Bench, Test, closed_loop
from rich.console import Console

from bench.figures.look import COLOURS, axes_grid, save, style
from bench.files import json_values, write_text
from bench.identification.memory import fit_memory
from bench.identification.network import fit_network
from bench.identification.polynomial import fit_polynomial
from bench.identification.restoring_force import JointData
from bench.reproduction import laboratory
from bench.reproduction.joint_models import LOADINGS
from bench.rig import Element, Rig, simulate
from bench.signals import BandLimitedNoise, Excitation, Harmonic, Tapered

TIMESTEP = 2e-4
HEADING = "# Records and the joints they make\n\nMade by `python scripts/coverage_study.py --docs docs`.\n\n"
Row = dict[str, Any]


def rig(elements: tuple[Element, ...]) -> Rig:
    """The laboratory with given elements for its joint."""
    return laboratory.rig().with_(elements=elements, timestep=TIMESTEP)


def _slow() -> Excitation:
    """Two slow tones that grow to their peaks and fade: long reversals at every amplitude."""
    tones = zip(("force", "torque"), peaks(), (0.7, 1.1), strict=True)
    half = 0.5 * SETS.seconds
    signals = {
        name: Tapered(Harmonic(amplitude=peak, frequency=f), fade_in=half, fade_out=half)
        for name, peak, f in tones
    }
    return Excitation(signals, duration=SETS.seconds + 0.1, sample_rate=laboratory.SETUP.rate)


def _low() -> Excitation:
    """Noise in the lower third of the band at half the level."""
    signals = {
        name: BandLimitedNoise(low=0.3, cutoff=3.0, peak=0.5 * peak)
        for name, peak in zip(("force", "torque"), peaks(), strict=True)
    }
    return Excitation(signals, duration=SETS.seconds, sample_rate=laboratory.SETUP.rate)


def unseen() -> dict[str, Excitation]:
    """Loads that models are judged under."""
    return {f"noise, {name}": drive(loaded) for name, loaded in LOADINGS.items()} | {
        "slow tones": _slow(),
        "half level, low band": _low(),
    }


def _memory(data: JointData) -> Element:
    assert data.time is not None
    model = fit_memory(data.states, data.forces, time=data.time, form="sliders", refine=6)
    return Element(model.law, laboratory.AXES, model.theta, name="joint")


def _network(data: JointData) -> Element:
    model = fit_network(
        data.states, data.forces, n_hidden=20, n_restarts=2, max_samples=4000, rng=np.random.default_rng(20)
    )
    return Element(model.law, laboratory.AXES, model.theta, name="joint")


def _polynomial(data: JointData) -> Element:
    model = fit_polynomial(data.states, data.forces, orders=3, bounded=True)
    return Element(model.law, laboratory.AXES, model.theta, name="joint")


MODELS: Mapping[str, Callable[[JointData], Element]] = {
    "memory": _memory,
    "network (20)": _network,
    "bounded polynomial (3)": _polynomial,
}


def rows_of(seed: int, progress: Callable[[str], None]) -> list[Row]:
    """Errors of all models from all sets of a seed."""
    true = laboratory.rig_with_friction().with_(timestep=TIMESTEP)
    rate = laboratory.SETUP.rate
    tests = {}
    for place, (name, excitation) in enumerate(unseen().items()):
        own = 90_000 + 100 * seed + place
        record = simulate(true, excitation, rng=np.random.default_rng(own), sample_rate=rate)
        tests[name] = Test(excitation, own, record)
    bench = Bench(rig, laboratory.AXES, tests, rate)
    found: list[Row] = []
    planned = sets(true, seed, TIMESTEP, progress)
    for label, drives in planned.drives.items():
        rng = np.random.default_rng([seed, 332])
        records = [
            laboratory.measured(simulate(true, d, rng=np.random.default_rng(s), sample_rate=rate), rng)
            for d, s in drives
        ]
        data = laboratory.view(*records)
        for name, fit in MODELS.items():
            progress(f"seed {seed}: {label}, {name}")
            element = fit(data)
            for test, judged in tests.items():
                worst, _ = closed_loop(bench._replace(tests={test: judged}), (element,), true.elements)
                row = {"seed": seed, "set": label, "model": name, "test": test, "nmse": worst}
                found.append(row | {"covered": planned.covered.get(label)})
    return found


def summary(rows: list[Row]) -> list[Row]:
    """Median over the seeds by model, set and test, and the worst test of each seed, median."""
    found = []
    for model in MODELS:
        for label in dict.fromkeys(row["set"] for row in rows):
            own = [row for row in rows if row["model"] == model and row["set"] == label]
            entry: Row = {"model": model, "set": label}
            by_test = {t: [r["nmse"] for r in own if r["test"] == t] for t in unseen()}
            entry |= {test: float(np.median(values)) for test, values in by_test.items()}
            worst = np.max(list(by_test.values()), axis=0)
            entry |= {
                "worst": float(np.median(worst)),
                "least": float(worst.min()),
                "largest": float(worst.max()),
            }
            found.append(entry)
    return found


def as_markdown(lines: list[Row]) -> str:
    """The table."""
    tests = list(unseen())
    head = f"| model | learnt from | {' | '.join(tests)} | worst of these (over seeds) |"
    rows = [head, "|" + "---|" * (len(tests) + 3)]
    for line in lines:
        values = " | ".join(_figure(line[test]) for test in tests)
        worst = f"{_figure(line['worst'])} ({_figure(line['least'])} … {_figure(line['largest'])})"
        rows.append(f"| {line['model']} | {line['set']} | {values} | {worst} |")
    return "\n".join(rows) + "\n"


def _figure(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "diverges"


def drawn(lines: list[Row]) -> Figure:
    """The worst test's error by model and set."""
    labels = list(dict.fromkeys(line["set"] for line in lines))
    with style():
        figure, grid = axes_grid(8.0, 3.6)
        axes = grid[0, 0]
        for place, label in enumerate(labels):
            own = [line for line in lines if line["set"] == label]
            x = np.arange(len(own)) + 0.18 * (place - 0.5 * (len(labels) - 1))
            middle = np.array([line["worst"] for line in own])
            ends = np.array(
                [[line["worst"] - line["least"], line["largest"] - line["worst"]] for line in own]
            ).T
            axes.errorbar(x, middle, ends, fmt="o", color=COLOURS[place], label=label, capsize=3)
        axes.set_yscale("log")
        axes.set_xticks(np.arange(len(MODELS)), list(MODELS))
        axes.set_ylabel("NMSE of a force, worst unseen test [%]")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


@dataclass
class Args:
    """Learn joints from several sets of records and judge them in closed loop."""

    seeds: int = 3
    """Seeds of loads, noise and candidates."""
    docs: Path | None = None
    """Folder for coverage_table.md and pictures/coverage.png."""
    json: bool = False
    """Print JSON."""


def main() -> None:
    """Run the study."""
    args = tyro.cli(Args, description=__doc__)
    console = Console(stderr=True)
    rows: list[Row] = []
    for seed in range(1, args.seeds + 1):
        rows += rows_of(seed, console.print)
    lines = summary(rows)
    if args.docs is not None:
        write_text(args.docs / "coverage_table.md", HEADING + as_markdown(lines))
        save(drawn(lines), args.docs / "pictures" / "coverage.png", dpi=90.0)
    if args.json:
        print(json.dumps(json_values({"rows": rows, "lines": lines}), indent=1, ensure_ascii=False))
    else:
        print(as_markdown(lines), end="")


if __name__ == "__main__":
    main()
