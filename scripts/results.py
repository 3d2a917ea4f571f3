"""Regenerate docs/results.md: every capability, the command that shows it, and the figure it gave last.

    python scripts/results.py                 all that the repository can show by itself
    python scripts/results.py demo native     only these
    python scripts/results.py --data FOLDER   also those that need measured records which are not shipped
    python scripts/results.py sealed          those that take hours run where they are named only

Figures of what is not run are kept from last time (docs/results.json).
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from benchmark import machine  # noqa: E402
from capabilities import CAPABILITIES, Capability  # noqa: E402

from bench.files import write_text  # noqa: E402


@dataclass
class Args:
    """Regenerate docs/results.md."""

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Capabilities to run; where none is named, all that can run and take no hours."""
    data: Path | None = None
    """Folder of the measured records that are not shipped."""


def main() -> int:
    """Run what was asked for, keep the rest, write the page."""
    args = tyro.cli(Args, description=__doc__)
    known = {capability.name for capability in CAPABILITIES}
    unknown = sorted(set(args.names) - known)
    if unknown:
        print(f"unknown capability {', '.join(unknown)}; known: {', '.join(sorted(known))}", file=sys.stderr)
        return 2
    store = ROOT / "docs" / "results.json"
    results: dict[str, Any] = json.loads(store.read_text(encoding="utf-8")) if store.exists() else {}
    console = Console(stderr=True)
    failed = False
    for capability in CAPABILITIES:
        wanted = capability.name in args.names or not (args.names or capability.hours)
        if not wanted or (
            capability.data and (args.data is None or not (args.data / capability.data).is_dir())
        ):
            continue
        with console.status(f"running {capability.name}"):
            told = _run(capability, args.data)
        if told is None:
            failed = True
            continue
        results[capability.name] = {
            "figures": capability.figures(told),
            "date": datetime.now(UTC).date().isoformat(),
            "machine": machine(),
        }
    write_text(store, json.dumps(results, indent=1, ensure_ascii=False) + "\n")
    write_text(ROOT / "docs" / "results.md", _page(results))
    return int(failed)


def _run(capability: Capability, data: Path | None) -> Any:
    here = Path(sys.executable).parent
    result: Any = None
    for line in (*capability.before, capability.command):
        command = [part.replace("{data}", str(data)) for part in line]
        command[0] = str(here / command[0])
        result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    try:
        return json.loads(
            result.stdout
        )  # a benchmark whose limit does not hold exits with 1 and still reports
    except json.JSONDecodeError:
        print(f"{capability.name}: {capability.shown()} failed:\n{result.stderr[-2000:]}", file=sys.stderr)
        return None


_NUMBER = re.compile(r"[-−+]?\d[\d  ]*(?:\.\d+)?(?:e[-+]?\d+)?|[-−+]?\.\d+")


def _numbers(text: str) -> list[float]:
    return [
        float(found.replace("−", "-").replace(" ", "").replace(" ", "")) for found in _NUMBER.findall(text)
    ]


def _verdict(what: str, figure: str, limit: str, verdict: str = "") -> str:
    """Whether a figure keeps its limit, **misses** marked; empty where the limit is no number or there is none.

    Of a figure its first number counts, before any bracket, or each of several with a stroke between them.
    """
    if verdict:
        return f"**{verdict}**" if verdict.startswith("does not hold") else verdict
    bound = re.match(r"(≤|≥|at most|at least)\s*([-−\d.]+)", limit)
    whole = re.fullmatch(r"([\d.]+) to ([\d.]+)( %)?", limit)
    apart = re.fullmatch(r"within ([\d.]+) %", limit)
    bracket = re.search(r"\(([-+][\d.]+) %\)", figure)
    if apart and bracket:
        return "holds" if abs(float(bracket[1])) <= float(apart[1]) else "**misses**"
    if limit == "100 %":
        bound = re.match(r"(≥)\s*(\d+)", "≥ 100")
    values = [number for part in figure.partition("(")[0].split("/") for number in _numbers(part)[:1]]
    if "→" in figure:
        values = _numbers(figure.partition("→")[2])[:1]
    if not values or not (bound or whole):
        return ""
    if whole:
        kept = all(float(whole[1]) <= value <= float(whole[2]) for value in values)
    else:
        assert bound is not None
        edge, most = float(bound[2].replace("−", "-")), bound[1] in {"≤", "at most"}
        kept = all(value <= edge if most else value >= edge for value in values)
    return "holds" if kept else "**misses**"


def _page(results: dict[str, Any]) -> str:
    lines = [
        "# Results",
        "Every capability, the command that shows it, and the figure it gave last. `python scripts/results.py` regenerates this page;",
        "with `--data FOLDER` also what needs measured records that may not be shipped. Figures of time depend on the machine; ratios",
        "are medians of interleaved runs, with the 10th and 90th percentile in brackets. What misses its limit is marked.",
        "",
    ]
    for capability in CAPABILITIES:
        entry = results.get(capability.name)
        lines += [f"## {capability.title}", f"`{capability.shown()}`", ""]
        if entry is None:
            lines += ["Not run yet.", ""]
            continue
        lines += ["| what | figure | must hold | verdict |", "|---|---|---|---|"]
        lines += ["| " + " | ".join([*row[:3], _verdict(*row)]) + " |" for row in entry["figures"]]
        lines += [
            "",
            f"{entry['date']}, {entry['machine']['cores']} cores, Python {entry['machine']['python']}.",
            "",
        ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
