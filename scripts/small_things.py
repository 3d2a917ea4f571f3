"""How often is a name that of a small thing that every rig has? The odds `judgement.coarse.besides`, from sealed cases with a background.

    jointbench blind make out/small/cases out/small/answers --n 80 --seed 20270101 --background --no-detectability --workers 2
    jointbench blind run out/small/cases out/small/results --workers 2
    python scripts/small_things.py out/small/results out/small/answers

Of verdicts that name one effect which no other comes near, and whose noise does not explain all, the likelihood of what came true is told
over the odds: a name is right with the probability that `bench.discrepancy.judgement.doubt` gives it.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import tyro
from rich.console import Console
from rich.table import Table

from bench.discrepancy.blind.background_score import right_names
from bench.discrepancy.judgement.doubt import like_small_things, outside

ODDS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0)
NEAR = 0.05
"""Probability over that of the name from which another effect comes near."""


@dataclass
class Args:
    """Likelihood of the odds that a name is that of a small thing."""

    results: tyro.conf.Positional[Path]
    """Folder of verdicts."""
    answers: tyro.conf.Positional[Path]
    """Folder of answers."""
    json: bool = False
    """Print JSON."""


class Name(NamedTuple):
    """A name that no other comes near.

    Attributes:
        size: What it closes of the judging records, as a part of the response (RMS).
        left: Part of the power that it leaves.
        right: Whether it is that of the withheld effect, or of something in the background.
    """

    size: float
    left: float
    right: bool


def names_in(results: Path, answers: Path) -> Iterator[Name]:
    """The names that no other comes near, of verdicts that noise does not explain."""
    for path in sorted(answers.glob("*.json")):
        answer, result = json.loads(path.read_text()), json.loads((results / path.name).read_text())
        ranked = [entry["probability"] for entry in result["ranking"]]
        sharp = result["complete"] and answer["noise_stated"] == "true"
        if len(result["named"]) != 1 or sharp or result["indistinguishable"]:
            continue
        if len(ranked) > 1 and ranked[1] > NEAR * ranked[0]:
            continue
        size, left = max((_closed(gap) for gap in result["gaps"]), key=lambda part: part[0])
        yield Name(size, left, result["named"][0]["name"] in right_names(answer))


def _closed(gap: dict[str, Any]) -> tuple[float, float]:
    """What is closed of a coordinate beyond noise, and the part of the power that is left."""
    before, after = (
        max(level**2 - gap["noise_floor"] ** 2, 0.0)
        for level in (min(gap["before"], gap["parameters_only"], 1.0), gap["after"])
    )
    return math.sqrt(max(before - after, 0.0)), min(after / max(before, 1e-300), 1.0)


def log_likelihood(names: list[Name], odds: float) -> float:
    """Log likelihood of what came true."""
    doubts = [outside(n.left, besides=odds * like_small_things(n.size)) for n in names]
    return sum(math.log(1.0 - d if n.right else d) for n, d in zip(names, doubts, strict=True))


def main() -> int:
    """Read, weigh, print."""
    args = tyro.cli(Args, description=__doc__)
    names = list(names_in(args.results, args.answers))
    told = {odds: log_likelihood(names, odds) for odds in ODDS}
    if args.json:
        rows = [{"odds": odds, "log_likelihood": value} for odds, value in told.items()]
        print(json.dumps({"names": len(names), "right": sum(n.right for n in names), "rows": rows}))
        return 0
    table = Table("odds", "log likelihood", title=f"{len(names)} names, {sum(n.right for n in names)} right")
    for odds, value in told.items():
        table.add_row(f"{odds:g}", f"{value:.2f}")
    Console().print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
