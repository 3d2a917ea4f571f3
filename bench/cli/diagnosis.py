"""Commands of the diagnosis: one case, and the blind protocol."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from bench.cli.console import emit, finite


@dataclass
class Diagnose:
    """Say where a simulation misses the measurement, which effect causes it, and how far the gap shrinks once it is added."""

    folder: tyro.conf.Positional[Path]
    """Case folder: nominal.json and the records (see docs/howto-mismatch.md)."""
    json: Path | None = None
    """File for the result as JSON; "-" prints it."""
    html: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File for the report, a self-contained HTML page."""
    exclude: tuple[str, ...] = ()
    """Effects to leave out of the catalogue."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy import diagnose_folder, write_report
        from bench.files import write_text

        with Console(stderr=True).status("reading") as status:
            diagnosis = diagnose_folder(self.folder, exclude=self.exclude, progress=status.update)
        document = diagnosis.verdict.to_json()
        if self.html is not None:
            write_report(diagnosis, self.html)
        if self.json == Path("-"):
            emit(document)
            return
        if self.json is not None:
            write_text(self.json, json.dumps(finite(document), indent=1, ensure_ascii=False))
        Console().print(diagnosis.verdict.explanation, markup=False, highlight=False)
        for warning in diagnosis.verdict.warnings:
            Console(stderr=True).print(f"note: {warning}", style="yellow", markup=False, highlight=False)


@dataclass
class BlindMake:
    """Make sealed cases; the answers go to another folder."""

    folder: tyro.conf.Positional[Path]
    """Folder for the cases."""
    answers: tyro.conf.Positional[Path]
    """Folder for the answers."""
    n: int = 20
    """Number of cases."""
    seed: int = 0
    """Seed of all randomness."""

    def __call__(self) -> None:
        """Run the command."""
        import numpy as np

        from bench.discrepancy import make_blind

        with Console(stderr=True).status("making cases") as status:
            names = make_blind(
                self.folder,
                self.answers,
                n=self.n,
                rng=np.random.default_rng(self.seed),
                progress=status.update,
            )
        print(f"{len(names)} cases in {self.folder}, answers in {self.answers}")


@dataclass
class BlindRun:
    """Diagnose every case of a folder; answers are never opened."""

    folder: tyro.conf.Positional[Path]
    """Folder of case folders."""
    results: tyro.conf.Positional[Path]
    """Folder for one JSON file a case."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy import run_blind

        console = Console()
        written = run_blind(
            self.folder,
            self.results,
            progress=lambda text: console.print(text, markup=False, highlight=False),
        )
        print(f"{len(written)} diagnoses in {self.results}")


@dataclass
class BlindScore:
    """Score diagnoses against the answers."""

    results: tyro.conf.Positional[Path]
    """Folder of JSON files that a diagnosis wrote."""
    answers: tyro.conf.Positional[Path]
    """Folder of the answers."""
    cases: Path | None = None
    """Folder of the cases, to check the answers against their seals."""
    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy import score_blind

        score = score_blind(self.results, self.answers, cases=self.cases)
        if self.json:
            emit(asdict(score))
            return
        for name, value in asdict(score).items():
            if name not in {"confusion", "wrong"}:
                print(
                    f"{name.replace('_', ' ')}: {value:.3g}"
                    if isinstance(value, float)
                    else f"{name}: {value}"
                )
        for line in score.wrong:
            print(f"  {line}")


@dataclass
class Blind:
    """The blind protocol: make sealed cases, diagnose them, score the diagnoses."""

    action: tyro.conf.OmitArgPrefixes[
        Annotated[BlindMake, tyro.conf.subcommand("make", prefix_name=False)]
        | Annotated[BlindRun, tyro.conf.subcommand("run", prefix_name=False)]
        | Annotated[BlindScore, tyro.conf.subcommand("score", prefix_name=False)]
    ]
    """What to do."""

    def __call__(self) -> None:
        """Run the command."""
        self.action()
