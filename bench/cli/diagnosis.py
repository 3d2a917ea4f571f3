"""Commands of the diagnosis: one case, and the blind protocol."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from bench.cli.console import emit

if TYPE_CHECKING:
    from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
    from bench.discrepancy.diagnosis import Diagnosis
    from bench.discrepancy.verdict import Verdict


@dataclass
class Diagnose:
    """Say where a simulation misses the measurement, which effect causes it, and how far the gap shrinks once it is added."""

    folder: tyro.conf.Positional[Path]
    """Case folder: nominal.json and the records (see docs/howto-mismatch.md)."""
    json: Path | None = None
    """File for the result as JSON; "-" prints it."""
    html: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File for the report, a self-contained HTML page."""
    rrd: Path | None = None
    """File for a rerun recording: measured and simulated channels, and where the gap lies."""
    exclude: tuple[str, ...] = ()
    """Effects to leave out of the catalogue."""
    most: int = 3
    """Largest number of effects named together."""
    anyway: bool = False
    """Go on where a unit, a sign or a part of the model stands against the diagnosis; what it was becomes a note."""
    budget: float = float("inf")
    """Seconds after which no further stage of the search is begun; the verdict is then the best one so far and says what was not tried."""
    force: bool = False
    """Overwrite files that exist."""
    progress: bool = True
    """Show what is being done, on standard error."""

    def __call__(self) -> None:
        """Run the command."""
        self._check_places()
        with _stages(self.progress) as stage:
            diagnosis = _diagnosed(self, stage)
            document = diagnosis.verdict.to_json()
            written, problem = self._written(diagnosis, document, stage)
        if self.json == PRINTED:
            emit(document)
        else:
            for part in summary(diagnosis.verdict):
                Console().print(part, markup=False, highlight=False)
            for path in written:
                print(f"written: {path}")
        for warning in diagnosis.verdict.warnings:
            Console(stderr=True, soft_wrap=True).print(
                f"note: {warning}", style="yellow", markup=False, highlight=False
            )
        if problem is not None:
            raise problem

    def _written(
        self,
        diagnosis: Diagnosis | ArticulatedDiagnosis,
        document: dict[str, Any],
        stage: Callable[[str], None],
    ) -> tuple[list[Path], Exception | None]:
        """The files written, moved into place together; where one fails, the verdict alone, and what failed."""
        from bench.files import OutputError, together, write_text

        text = json.dumps(document, indent=1, ensure_ascii=False)
        saved = [self.json] if self.json is not None and self.json != PRINTED else []
        try:
            with together():
                for path in saved:
                    write_text(path, text)
                if self.html is not None:
                    from bench.discrepancy import write_report

                    stage(f"writing {self.html}")
                    write_report(diagnosis, self.html)
                if self.rrd is not None:
                    from bench.discrepancy.report.rerun_recording import write_rerun

                    stage(f"writing {self.rrd}")
                    write_rerun(diagnosis, self.rrd)
        except Exception as error:  # whatever a figure ran into: the verdict is told and kept
            problem = OutputError(f"the report of this verdict cannot be written: {error}")
            with contextlib.suppress(OutputError):
                for path in saved:
                    write_text(path, text)
                return saved, problem
            return [], problem
        return [path for path in (*saved, self.html, self.rrd) if path is not None], None

    def _check_places(self) -> None:
        """Refuse places that cannot be written to before a minute is spent on the diagnosis."""
        from bench.errors import ParameterError
        from bench.targets import check_targets

        if self.most < 1:
            raise ParameterError(f"--most is {self.most}; at least one effect has to be allowed")
        if not self.budget > 0.0:
            raise ParameterError(f"--budget is {self.budget:g} s; give more than zero")
        check_targets(self.json, self.html, self.rrd, force=self.force)


PRINTED = Path("-")
"""Stands for standard output."""


@contextlib.contextmanager
def _stages(shown: bool) -> Iterator[Callable[[str], None]]:
    """A line on standard error with what is being done and for how long; call what is given with the text."""
    columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=Console(stderr=True), disable=not shown, transient=True) as bar:
        task = bar.add_task("reading", total=None)
        yield lambda text: bar.update(task, description=text)


def _diagnosed(asked: Diagnose, stage: Callable[[str], None]) -> Diagnosis | ArticulatedDiagnosis:
    """The diagnosis of a folder; what numerics cannot cope with is told like any other input that cannot be used."""
    import numpy as np

    from bench.discrepancy import diagnose_folder
    from bench.errors import IdentificationError

    try:
        return diagnose_folder(
            asked.folder,
            exclude=asked.exclude,
            most=asked.most,
            anyway=asked.anyway,
            progress=stage,
            budget=asked.budget,
        )
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        raise IdentificationError(
            f"the numbers of '{asked.folder}' cannot be worked with ({error}); check nominal values, units and noise_std: "
            "one of them is probably off by orders of magnitude"
        ) from error


def summary(verdict: Verdict) -> list[Any]:
    """A verdict for people: sentences and tables to print.

    Args:
        verdict: The verdict.
    """
    from bench.discrepancy.judgement.shares import closed_words, interval, probability

    parts: list[Any] = [verdict.explanation]
    for effects, title in (
        (verdict.named, "Missing from the model"),
        (verdict.nearest, "What comes nearest"),
    ):
        if not effects:
            continue
        table = Table("effect", "where", "probability", "closes", "parameters", title=title)
        for effect in effects:
            values = "\n".join(
                f"{name} = {p.value:.5g} ± {p.std:.2g} {p.unit if p.unit != '1' else ''}".rstrip()
                for name, p in effect.parameters.items()
            )
            where = " ".join(text for text in (effect.where, effect.channel) if text)
            closes = interval(effect.closed, effect.closed_ci95)
            table.add_row(effect.name, where, probability(effect.probability), closes, Text(values))
        parts.append(table)
    for gap in verdict.gaps:
        label = f"{gap.dof}: {gap.metric}" if gap.dof else gap.metric
        table = Table("model", "NRMSE", "closed", title=f"How far the gap shrinks ({label})")
        steps = gap.steps or (("nominal", gap.before), ("after", gap.after))
        for name, value in steps[:-1]:
            table.add_row(name, f"{value:.3g}", "" if value == gap.before else closed_words(gap, value))
        table.add_row(steps[-1][0], f"{steps[-1][1]:.3g}", closed_words(gap))
        table.add_row("noise alone", f"{gap.noise_floor:.3g}", "")
        parts.append(table)
    if verdict.left:
        parts.append(verdict.left)
    for names in verdict.indistinguishable:
        parts.append(f"These records cannot tell {' from '.join(names)}.")
    proposal = verdict.next_excitation
    if proposal.get("reason"):
        parts.append(proposal["reason"])
    if proposal.get("separates") and proposal.get("excitation"):
        parts.append(
            f"To separate {' from '.join(proposal['separates'])}: {proposal['excitation']}, peak load "
            f"{proposal['peak_load']:.3g}, {proposal['duration_s']:.3g} s; power {100 * proposal['power']:.0f} %."
        )
    return parts


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
    rigs: tuple[float, float, float] = (0.65, 0.15, 0.2)
    """Shares of the rigs sdof, damper and joint."""
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
        from bench.discrepancy.blind.background_settings import BackgroundSettings
        from bench.discrepancy.blind.protocol import SEAL
        from bench.discrepancy.blind.rigs import BACKGROUND_SHARES
        from bench.targets import check_folder

        begun = next(self.folder.glob(f"*/{SEAL}"), None) is not None  # by the same command, which goes on
        for folder in (self.folder, self.answers):
            check_folder(folder, force=self.force or begun)
        chosen = {key: value for key, value in vars(self).items() if key in BlindOptions.__dataclass_fields__}
        chosen["background"] = BackgroundSettings() if self.background else None
        if self.background and self.shares == BlindOptions().shares:
            chosen["shares"] = BACKGROUND_SHARES
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
        from bench.discrepancy.blind.score_report import markdown, page, tables
        from bench.files import together, write_text
        from bench.targets import check_targets

        check_targets(self.html, self.markdown, force=self.force)
        score = score_blind(self.results, self.answers, cases=self.cases)
        with together():
            if self.html is not None:
                page(score).write(self.html)
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
