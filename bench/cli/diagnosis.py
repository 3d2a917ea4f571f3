"""The blind protocol by command."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console
from rich.table import Table
from rich.text import Text

from bench.cli.console import emit


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
    """Seed of all randomness; the same seed makes the same cases, answers and seals."""
    gap: tuple[float, float] = (0.03, 0.6)
    """Smallest and largest gap (NRMSE)."""
    noise: tuple[float, float] = (0.003, 0.03)
    """Smallest and largest noise, as a part of a channel's standard deviation."""
    shares: tuple[float, float, float, float] = (0.15, 0.55, 0.15, 0.15)
    """Shares of clean, single, double and foreign cases."""
    rigs: tuple[float, float, float] | tuple[Literal["arm", "leg", "servo"], ...] = (0.65, 0.15, 0.2)
    """Shares of the rigs sdof, damper and joint; or kinds of robots instead of them: arm, leg, servo."""
    effects: tuple[str, ...] = ()
    """Effects to draw from; all where none is named."""
    duration: float = 10.0
    """Length of a record [s]."""
    sample_rate: float = 500.0
    """Sample rate [Hz]."""
    leave_one_out: bool = False
    """Single effects only, each struck from the catalogue that its diagnosis may use."""
    detectability: bool = True
    """Compute how well the records of each case can tell its effect, for the answers."""
    background: bool = False
    """A small background that no model has beside each effect or none, its part 5 to 30 % of the main discrepancy; noise that is stated,
    stated too small, or not."""
    workers: int = 1
    """Processes."""
    force: bool = False
    """Write into folders that hold files of others."""

    def __call__(self) -> None:
        """Run the command."""
        import numpy as np

        from bench.discrepancy import BlindOptions, make_blind
        from bench.discrepancy.blind.protocol import SEAL
        from bench.discrepancy.truth.background_settings import BackgroundSettings
        from bench.discrepancy.truth.loads import RIGS_SETTINGS
        from bench.targets import check_target_folder

        begun = next(self.folder.glob(f"*/{SEAL}"), None) is not None  # by the same command, which goes on
        for folder in (self.folder, self.answers):
            check_target_folder(folder, force=self.force or begun)
        chosen = {key: value for key, value in vars(self).items() if key in BlindOptions.__dataclass_fields__}
        if isinstance(self.rigs[0], str):
            chosen["robots"] = chosen.pop("rigs")
        chosen["background"] = BackgroundSettings() if self.background else None
        if self.background and self.shares == BlindOptions().shares:
            chosen["shares"] = RIGS_SETTINGS.background_shares
        with Console(stderr=True).status("making cases") as status:
            names = make_blind(
                self.folder,
                self.answers,
                n=self.n,
                rng=np.random.default_rng(self.seed),
                options=BlindOptions(**chosen),
                workers=self.workers,
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
    workers: int = 1
    """Processes."""
    again: bool = False
    """Diagnose cases whose result is there already as well."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy import run_blind

        console = Console()
        written = run_blind(
            self.folder,
            self.results,
            again=self.again,
            workers=self.workers,
            progress=lambda text: console.print(text, markup=False, highlight=False, soft_wrap=True),
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
    html: Path | None = None
    """File for the scores as a self-contained page."""
    markdown: Path | None = None
    """File for the scores as Markdown."""
    force: bool = False
    """Overwrite files that exist."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy import score_blind
        from bench.discrepancy.blind.score_report import markdown, score_page, tables
        from bench.files import together, write_text
        from bench.targets import check_targets

        check_targets(self.html, self.markdown, force=self.force)
        score = score_blind(self.results, self.answers, cases=self.cases)
        with together():
            if self.html is not None:
                score_page(score).write(self.html)
            if self.markdown is not None:
                write_text(self.markdown, markdown(score))
        if self.json:
            emit(score.to_json())
            return
        console = Console()
        for table in tables(score):
            shown = Table(*table.header, title=table.caption, title_justify="left")
            for row in table.rows:
                shown.add_row(*(Text(cell) for cell in row))
            console.print(shown)


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
