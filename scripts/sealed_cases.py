"""Make sealed cases, diagnose them, score them, and write docs/blind_results.md and docs/blind_results.json.

    python scripts/sealed_cases.py                       300 cases and 60 with their true effect struck from the catalogue
    python scripts/sealed_cases.py --n 60 --struck 0     fewer
    python scripts/sealed_cases.py --seed 12345          others

Stopped, it goes on where it was: what is made and diagnosed stays in the work folder. `--again` diagnoses anew.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from benchmark import machine  # noqa: E402
from checkout import commit  # noqa: E402

from bench.discrepancy import BlindOptions, BlindScore, make_blind, run_blind  # noqa: E402
from bench.discrepancy.blind.score_report import markdown, score_page  # noqa: E402
from bench.discrepancy.blind.scoring import score_cases, summary  # noqa: E402
from bench.files import write_text  # noqa: E402
from bench.provenance import provenance  # noqa: E402


@dataclass
class Args:
    """Make sealed cases, diagnose them, score them, and write docs/blind_results.{md,json}."""

    n: int = 300
    """Number of cases."""
    struck: int = 60
    """Number of further cases whose true effect is struck from the catalogue."""
    seed: int = 20261121
    """Seed of all cases."""
    work: Path = ROOT / "out" / "sealed"
    """Folder for cases, answers and results; a folder of its own for every seed."""
    workers: int = 2
    """Processes."""
    again: bool = False
    """Diagnose cases whose result is there already as well."""
    out: Path = ROOT / "docs" / "blind_results"
    """The files to write, without suffix."""
    json: bool = False
    """Print the figures as JSON as well."""
    html: Path | None = None
    """File for the scores as a page, where wanted."""


def main() -> int:
    """Make, run, score, write."""
    args = tyro.cli(Args, description=__doc__)
    console = Console(stderr=True)
    scored, commits = [], set[str]()
    began = time.perf_counter()
    for name, n, options in (
        ("sealed", args.n, BlindOptions()),
        ("struck", args.struck, BlindOptions(leave_one_out=True)),
    ):
        if n == 0:
            continue
        folders = [args.work / f"{args.seed}-{name}" / part for part in ("cases", "answers", "results")]
        cases, answers, results = folders
        rng = np.random.default_rng([args.seed, int(options.leave_one_out)])

        def tell(text: str) -> None:
            console.print(text, markup=False, highlight=False)

        make_blind(cases, answers, n=n, rng=rng, options=options, workers=args.workers, progress=tell)
        commits |= _commits(cases, results, again=args.again)
        run_blind(cases, results, again=args.again, workers=args.workers, progress=tell)
        scored += score_cases(results, answers, cases=cases)
    write(args, summary(scored), sorted(commits), time.perf_counter() - began)
    return 0


def _commits(cases: Path, results: Path, *, again: bool) -> set[str]:
    """Commits that diagnosed cases: kept beside the results, the present one added where some are still to be diagnosed."""
    kept = results.parent / "commits"
    told = set() if again or not kept.exists() else set(kept.read_text(encoding="utf-8").split())
    made = (path.parent.name for path in cases.glob("*/nominal.json"))
    if again or any(not (results / f"{name}.json").exists() for name in made):
        told.add(commit())
        write_text(kept, "\n".join(sorted(told)))
    return told or {"unknown"}


def write(args: Args, score: BlindScore, commits: list[str], seconds: float) -> None:
    """Write the scores as Markdown, as JSON, and as a page where wanted."""
    document: dict[str, Any] = {
        "command": f"python scripts/sealed_cases.py --n {args.n} --struck {args.struck} --seed {args.seed}",
        "machine": machine(),
        "provenance": provenance(seed=args.seed, commits=commits),
        "seconds": seconds,
        "score": score.to_json(),
    }
    lead = (
        f"Made by `{document['command']}` on {machine()['cores']} cores; what is drawn, and what counts as right, stands in "
        "[blind.md](blind.md). The cases were made by integrators that the fits do not use, and diagnosed without their answers "
        f"by commit {', '.join(commits)}."
    )
    write_text(args.out.with_suffix(".json"), json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    write_text(args.out.with_suffix(".md"), markdown(score, title="Sealed cases", lead=lead))
    if args.html is not None:
        score_page(score, title="Sealed cases", lead=lead).write(args.html)
    print(json.dumps(document) if args.json else args.out.with_suffix(".md"))


if __name__ == "__main__":
    sys.exit(main())
