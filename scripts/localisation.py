"""How well forces that act in a part of the state space only are located: planted cases, and their F1 score.

    python scripts/localisation.py [--json] [--repeats 1]

Each case is a rig (sdof, one axis of the joint, one spring of a chain of three masses) with nominal parameters off by their
uncertainty, under noise; a force that no catalogue names acts at one place, in one part of the state space or of time. The records
are integrated with twenty steps a sample. `bench.discrepancy.localisation.state_map` sees the records and the nominal model only.

What counts: the cells of the map of every place, 12 by 12 over displacement and velocity, that the motion visited at least twice.
Truth are the cells in which the mean of the planted force along the true motion exceeds 15 % of its largest cell; found are the
cells that the map marks. For a force that acts for a time only, cells are 40 intervals of the record, and truth those in
which the planted force's mean square exceeds 15 % squared of its largest. A marked cell at another place counts as a mistake. F1 is
the harmonic mean of precision and recall over these cells, case by case; its mean over cases is printed.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from planted_forces import KINDS, RIGS, HostRig, PlantedForce

from bench.arrays import Array
from bench.discrepancy import Case, CaseChannel, NominalParameter, record_from_arrays
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.localisation.state_map import CELLS, cell_index, state_maps
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.simulation.prescribed_response import driven_force
from bench.discrepancy.simulation.stick_slip import Elements, free_run

NOISES = (0.003, 0.01, 0.03)
SUBSTEPS = 20
RATE, DURATION = 1000.0, 20.0
STRENGTHS = (0.1, 0.3)
"""Largest planted force as a part of the largest load."""


class Planted(NamedTuple):
    """A planted case.

    Attributes:
        problem: What the diagnosis sees.
        place: Where the force acts.
        displacement: (n,) true displacement of that place.
        velocity: (n,).
        force: (n,) planted force.
    """

    problem: Problem
    place: str
    displacement: Array
    velocity: Array
    force: Array


def plant(rig: HostRig, kind: PlantedForce, place: str, noise: float, rng: np.random.Generator) -> Planted:
    """Make a case with a force at a place."""
    units = {"force": "N", "torque": "N m"}
    bare = Case(
        "planted",
        rig.name,
        tuple(NominalParameter(name, value, 0.0) for name, (value, _) in rig.parameters.items()),
        tuple(
            CaseChannel(name, units.get(name, ""), "measured" if name in rig.loads else "response", 1.0)
            for name in (*rig.loads, *rig.channels)
        ),
        (),
        (),
    )  # fmt: skip
    structure = rig.build(bare)
    n = round(DURATION * RATE)
    time = np.arange(n) / RATE
    linear = structure.at(np.array([value for value, _ in rig.parameters.values()]))
    top = (
        1.6
        * math.sqrt(float(np.max(np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)).real)))
        / (2 * math.pi)
    )
    loads = np.column_stack([_noise(n, top, rng) for _ in rig.loads]) * [20.0, 1.0][: len(rig.loads)]
    still = free_run(
        linear, _elements(None, (), structure, place), loads=loads, step=1 / RATE, substeps=SUBSTEPS
    )
    row = next(p for p in structure.places if p.name == place).rows[0]
    reach = {
        "displacement": np.abs(still.position @ row).max(),
        "velocity": np.abs(still.velocity @ row).max(),
        "time": DURATION,
    }
    begin = rng.uniform(*kind.begins) * reach[kind.over]
    axis = 1 if place == "torsional" else 0
    wanted = rng.uniform(*STRENGTHS) * np.abs(loads[:, axis]).max()
    strength = wanted
    for _ in range(3):
        theta = (strength, begin, 0.1 * DURATION)
        planted = _elements(kind.law, theta, structure, place)
        motion = free_run(linear, planted, loads=loads, step=1 / RATE, substeps=SUBSTEPS)
        x, v = motion.position @ row, motion.velocity @ row
        force = driven_force(planted, position=x[:, None], velocity=v[:, None], step=1 / RATE)[:, 0]
        strength *= wanted / max(float(np.abs(force).max()), 1e-12)
    clean = dict(zip(structure.channels, (motion[o.order] @ o.row for o in structure.observers), strict=True))
    clean |= {name: loads[:, j] for j, name in enumerate(rig.loads)}
    stds = {name: noise * float(np.std(y)) for name, y in clean.items()}
    record = record_from_arrays(
        "identification", time, {name: y + stds[name] * rng.standard_normal(n) for name, y in clean.items()}
    )
    nominal = tuple(
        NominalParameter(name, value + std * rng.standard_normal(), std)
        for name, (value, std) in rig.parameters.items()
    )
    channels = tuple(CaseChannel(c.name, c.unit, c.role, stds[c.name]) for c in bare.channels)
    case = Case("planted", rig.name, nominal, channels, (record,), (record,))
    return Planted(Problem(case, rig.build(case), (record,)), place, x, v, force)


def _noise(n: int, top: float, rng: np.random.Generator) -> Array:
    """Noise flat up to a frequency [Hz], ramped in over a fifth of a second, of unit RMS."""
    spectrum = np.fft.rfft(rng.standard_normal(n))
    spectrum[np.fft.rfftfreq(n, 1 / RATE) > top] = 0.0
    y = np.fft.irfft(spectrum, n) * np.minimum(np.arange(n) / (0.2 * RATE), 1.0)
    return y / np.sqrt(np.mean(y**2))


def _elements(law: Any, theta: tuple[float, ...], structure: Structure, place: str) -> Elements:
    rows = next(p for p in structure.places if p.name == place).rows
    if law is None:
        return Elements(
            np.zeros((0, 8), dtype=np.int64), np.zeros((0, rows.shape[1])), np.zeros(1), np.zeros(0)
        )
    return Elements(
        np.array([[law.address, 0, 0, 1, 0, 0, 0, 0]]), rows, np.array([*theta, 0.0]), np.zeros(0)
    )


def score(case: Planted, over: str) -> dict[str, float]:
    """Precision, recall and F1 of the cells found."""
    right = wrong = missed = 0
    settings = case.problem.settings.localisation
    for found in state_maps(case.problem, case.problem.records):
        here = found.place.name == case.place
        if over == "time":
            power = np.array([np.mean(part**2) for part in np.array_split(case.force, settings.intervals)])
            truth = (power > settings.weak**2 * power.max()) & here
            marked = found.active[0]
        else:
            cell = cell_index(
                case.displacement, case.velocity, (found.displacement_edges, found.velocity_edges)
            )
            count = np.bincount(cell, minlength=CELLS * CELLS)
            mean = np.bincount(cell, case.force, CELLS * CELLS) / np.maximum(count, 1)
            mean = np.where(np.isfinite(found.force.ravel()), mean, 0.0)
            truth = (np.abs(mean) > settings.weak * np.abs(mean).max()) & here
            marked = found.significant.ravel()
        right += int(np.sum(truth & marked))
        wrong += int(np.sum(~truth & marked))
        missed += int(np.sum(truth & ~marked))
    precision = right / max(right + wrong, 1)
    recall = right / max(right + missed, 1)
    f1 = 2 * right / max(2 * right + wrong + missed, 1)
    return {"f1": f1, "precision": precision, "recall": recall}


def run(repeats: int, progress: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Score all kinds at all places and noise levels."""
    rows: list[dict[str, Any]] = []
    for repeat in range(repeats):
        for r, rig in enumerate(RIGS):
            for p, place in enumerate(rig.places):
                for k, (name, kind) in enumerate(KINDS.items()):
                    for i, noise in enumerate(NOISES):
                        rng = np.random.default_rng([repeat, r, p, k, i])
                        found = score(plant(rig, kind, place, noise, rng), kind.over)
                        rows.append({"kind": name, "rig": rig.name, "place": place, "noise": noise, **found})
                        progress(f"{name:20} {rig.name} {place:10} {100 * noise:.1f} %: F1 {found['f1']:.3f}")
    return {
        "cases": len(rows),
        "f1": _mean(rows),
        "f1_median": float(np.median([row["f1"] for row in rows])),
        "by_kind": {name: _mean([row for row in rows if row["kind"] == name]) for name in KINDS},
        "by_rig": {rig.name: _mean([row for row in rows if row["rig"] == rig.name]) for rig in RIGS},
        "by_noise": {str(noise): _mean([row for row in rows if row["noise"] == noise]) for noise in NOISES},
        "rows": rows,
    }


def _mean(rows: list[dict[str, Any]]) -> float:
    return float(np.mean([row["f1"] for row in rows]))


def main() -> None:
    """Print the scores."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--repeats", type=int, default=1, help="draws of every combination")
    args = parser.parse_args()
    result = run(args.repeats, (lambda text: None) if args.json else print)
    if args.json:
        print(json.dumps(result, indent=1))
        return
    for title in ("by_kind", "by_rig", "by_noise"):
        for name, value in result[title].items():
            print(f"{name:24} F1 {value:.3f}")
    print(
        f"{'all ' + str(result['cases']) + ' cases':24} F1 {result['f1']:.3f}, median {result['f1_median']:.3f}"
    )


if __name__ == "__main__":
    main()
