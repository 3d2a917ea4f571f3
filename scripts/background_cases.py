"""Diagnose cases whose truth holds a small background besides, in one process, and score them against their answers.

    python scripts/background_cases.py CASES ANSWERS                  results in out/background/COMMIT
    python scripts/background_cases.py CASES ANSWERS --part 0 2       every second case only, for a second process beside

Stopped, it goes on where it was. The verdicts of a commit are kept by its hash; `--again` diagnoses anew.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import tyro
from rich.console import Console

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from checkout import commit  # noqa: E402

from bench.discrepancy import diagnose_folder  # noqa: E402
from bench.discrepancy.blind.background_score import BackgroundScore, score_backgrounds  # noqa: E402
from bench.errors import BenchError  # noqa: E402
from bench.files import json_values, write_text  # noqa: E402


@dataclass
class Args:
    """Diagnose cases with a background, and score them."""

    cases: tyro.conf.Positional[Path]
    """Folder of case folders."""
    answers: tyro.conf.Positional[Path]
    """Folder of answers by the names of the cases; no diagnosis opens it."""
    out: Path = ROOT / "out" / "background"
    """Folder for the results; those of a commit lie in a folder of its own."""
    part: tuple[int, int] = (0, 1)
    """Which part of the cases, of how many."""
    again: bool = False
    """Diagnose cases whose result is there already as well."""
    json: bool = False
    """Print the score as JSON."""


def main() -> int:
    """Diagnose and score."""
    args = tyro.cli(Args, description=__doc__)
    console = Console(stderr=args.json)
    results = args.out / commit()
    results.mkdir(parents=True, exist_ok=True)
    folders = sorted(folder for folder in args.cases.iterdir() if (folder / "nominal.json").exists())
    for folder in folders[args.part[0] :: args.part[1]]:
        kept = results / f"{folder.name}.json"
        if kept.exists() and not args.again:
            continue
        began = time.process_time()
        try:
            verdict = diagnose_folder(folder).verdict.to_json()
        except BenchError as error:
            console.print(f"{folder.name}: {error}", markup=False, highlight=False)
            continue
        verdict["cpu_seconds"] = time.process_time() - began
        write_text(kept, json.dumps(verdict))
        said = ", ".join(f"{e['name']} {e['probability']:.2f}" for e in verdict["named"])
        gap = verdict["gap"]
        console.print(
            f"{folder.name}: {verdict['verdict']} {said}; {gap['before']:.3g} to {gap['after']:.3g}, {verdict['cpu_seconds']:.1f} s",
            markup=False,
            highlight=False,
        )
    score = score_backgrounds(results, args.answers)
    if args.json:
        print(json.dumps(json_values(asdict(score)), indent=1))
    else:
        _tell(console, score)
    return 0


def _tell(console: Console, score: BackgroundScore) -> None:
    for line in score.wrong:
        console.print(line, markup=False, highlight=False)
    for what, share in score.shares.items():
        console.print(
            f"{what}: {share.value:.2f} of {share.n} ({share.low:.2f} to {share.high:.2f})",
            markup=False,
            highlight=False,
        )
    console.print(
        f"expected calibration error of names: {score.calibration:.3f} ({score.interval[0]:.3f} to {score.interval[1]:.3f}); "
        f"{score.scatter:.3f} if every probability were exact"
    )
    for stated, right, n in score.reliability:
        console.print(f"  stated {stated:.2f}, right {right:.2f}, of {n}")


if __name__ == "__main__":
    raise SystemExit(main())
