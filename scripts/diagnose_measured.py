"""Diagnose measured records, the effect never named to the tool.

    python scripts/diagnose_measured.py
    python scripts/diagnose_measured.py --data FOLDER bouc_wen silverbox --json
    python scripts/diagnose_measured.py --data FOLDER bouc_wen silverbox --unstated

Without FOLDER the friction damper that comes with the bench is diagnosed. FOLDER holds what may not be shipped, in the
sub-folders that the modules in scripts/measured name. NAMES are cases or beginnings of their names; all where none is given.
With --unstated the diagnosis is not told what is known of the acquisition (how loads ran between samples, which records are periods
of a steady state or begin in motion, which filters responses passed), as in a folder with a bare nominal.json; no target is set then.
"""

from __future__ import annotations

import importlib
import json
import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent))

from measured.target import Target

from bench.discrepancy import Case, CaseRecord, Diagnosis, diagnose
from bench.errors import BenchError

SOURCES = tuple(
    sorted(
        path.stem
        for path in (Path(__file__).parent / "measured").glob("[a-z]*.py")
        if path.stem not in {"target", "acceptance"}
    )
)


@dataclass
class Args:
    """Diagnose measured records."""

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Cases, or beginnings of their names; all where none is given."""
    data: Path | None = None
    """Folder of the records that are not shipped."""
    json: bool = False
    """Print JSON."""
    unstated: bool = False
    """Say nothing of the acquisition."""
    html: Path | None = None
    """Folder for a report page of every case."""


@dataclass(frozen=True)
class Outcome:
    """What came of a diagnosis, on one judging record.

    Attributes:
        case: Case.
        record: Judging record.
        verdict: "effect", "none" or "unknown".
        named: Names of the effects.
        before: Error of the nominal model.
        after: Error of the final model.
        limit: Largest error to be reached; None where none is set.
        unit: Unit of the errors.
        seconds: Wall time of the whole diagnosis [s].
        parameters: Estimates of every named effect.
        published: Of every published parameter that the explanation has as well, both values and by how many percent they differ.
    """

    case: str
    record: str
    verdict: str
    named: tuple[str, ...]
    before: float
    after: float
    limit: float | None
    unit: str
    seconds: float
    parameters: dict[str, Any]
    published: dict[str, dict[str, float]]


class Wanted(NamedTuple):
    """A case, what it is to reach, and what others found its parameters to be."""

    case: Case
    target: Target | None
    published: dict[str, float]


def gather(data: Path | None, names: tuple[str, ...]) -> dict[str, Wanted]:
    """The wanted cases of every source."""
    found: dict[str, Wanted] = {}
    for source in SOURCES:
        # the names of cases begin with their source's: what nobody asked for need not be readable
        if names and not any(source.startswith(wanted) or wanted.startswith(source) for wanted in names):
            continue
        module = importlib.import_module(f"measured.{source}")
        folder = (data or Path("none")) / getattr(module, "FOLDER", source)
        if getattr(module, "SHIPPED", False) is False and not folder.is_dir():
            continue
        for name, case in module.cases(folder).items():
            if not names or any(name.startswith(wanted) for wanted in names):
                found[name] = Wanted(case, getattr(module, "TARGET", None), getattr(module, "PUBLISHED", {}))
    return found


def bare(wanted: Wanted) -> Wanted:
    """A case of which nothing is said but the nominal model, the channels and the records."""

    def plain(record: CaseRecord) -> CaseRecord:
        return replace(record, at_rest=True, periodic=False)

    case = replace(
        wanted.case,
        channels=tuple(replace(channel, antialias=None) for channel in wanted.case.channels),
        identification=tuple(plain(record) for record in wanted.case.identification),
        validation=tuple(plain(record) for record in wanted.case.validation),
        options={},
    )
    target = wanted.target and wanted.target._replace(limit=np.nan)
    return wanted._replace(case=case, target=target)


def against(diagnosis: Diagnosis, published: dict[str, float]) -> dict[str, dict[str, float]]:
    """Estimates of the first explanation beside the published values."""
    found = {name: value.value for e in diagnosis.verdict.named for name, value in e.parameters.items()}
    for problem, fitted in diagnosis.explanations[0].parts:
        values, _ = problem.split(fitted.hypothesis, fitted.vector)
        found |= {name: float(x) for name, x in zip(problem.structure.parameters, values, strict=False)}
    return {
        name: {"found": found[name], "published": value, "percent": 100.0 * (found[name] / value - 1.0)}
        for name, value in published.items()
        if name in found
    }


def outcomes(diagnosis: Diagnosis, wanted: Wanted) -> list[Outcome]:
    """One outcome a judging record."""
    verdict, problem = diagnosis.verdict, diagnosis.problem
    channel = problem.structure.channels[0]
    target = wanted.target or Target(channel, "nrmse", np.nan, "1")
    published = against(diagnosis, wanted.published)
    column = problem.structure.channels.index(target.channel)
    zero = np.zeros(len(problem.nominal))
    out = []
    for record in diagnosis.case.validation:
        measured = record.values[target.channel]
        before = target.error(measured, problem.simulate((), zero, record)[:, column])
        after = target.error(measured, diagnosis.final.predict(record)[target.channel])
        out.append(
            Outcome(
                diagnosis.case.name, record.name, verdict.verdict, tuple(e.name for e in verdict.named), before, after,
                target.limit if np.isfinite(target.limit) else None, target.unit, verdict.seconds,
                {e.name: {k: asdict(v) for k, v in e.parameters.items()} for e in verdict.named}, published,
            )
        )  # fmt: skip
    return out


def table(rows: list[Outcome]) -> Table:
    """Outcomes as a table."""
    out = Table(
        "case", "record", "verdict", "named", "before", "after", "target", "seconds", "off the published"
    )
    for row in rows:
        reached = "" if row.limit is None else f"≤ {row.limit:g} {'yes' if row.after <= row.limit else 'no'}"
        off = ", ".join(f"{name} {entry['percent']:+.1f} %" for name, entry in row.published.items())
        unit = "" if row.unit == "1" else f" {row.unit}"
        out.add_row(
            row.case, row.record, row.verdict, " + ".join(row.named) or "-", f"{row.before:.3g}{unit}",
            f"{row.after:.3g}{unit}", reached, f"{row.seconds:.1f}", off,
        )  # fmt: skip
    return out


def main() -> int:
    """Diagnose and print."""
    args = tyro.cli(Args, description=__doc__)
    console = Console(stderr=True)
    try:
        rows = diagnosed(args, console)
    except BenchError as error:
        console.print(f"error: {error}", style="red", markup=False, highlight=False)
        return 2
    if args.json:
        print(json.dumps([asdict(row) for row in rows], indent=2))
    else:
        Console(width=None if sys.stdout.isatty() else 140).print(table(rows))
    return 0


def diagnosed(args: Args, console: Console) -> list[Outcome]:
    """Diagnose the wanted cases."""
    rows: list[Outcome] = []
    for name, stated in gather(args.data, args.names).items():
        wanted = bare(stated) if args.unstated else stated
        diagnosis = diagnose(wanted.case, progress=lambda text, name=name: console.print(f"{name}: {text}"))
        if args.html:
            from bench.discrepancy import write_report

            args.html.mkdir(parents=True, exist_ok=True)
            write_report(diagnosis, args.html / f"{name}.html")
        assert isinstance(diagnosis, Diagnosis)  # none of these sets is articulated
        rows += outcomes(diagnosis, wanted)
    return rows


if __name__ == "__main__":
    sys.exit(main())
