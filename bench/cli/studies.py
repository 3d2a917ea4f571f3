"""Commands that run for a while: the dissertation reproduced, and campaigns of many records."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.table import Table

from bench.cli.console import emit, progress_bar


@dataclass
class Reproduce:
    """Regenerate figures and tables of the dissertation beside the printed ones. Goes on where it was stopped."""

    items: tyro.conf.Positional[tuple[str, ...]] = ()
    """Items (A1, B2, D4, …) or chapters (A, B, C, D); all where none is named."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("out/reproduce")
    """Folder for the page, the table and the pictures."""
    fresh: bool = False
    """Make again what was already made by the same code."""
    force: bool = False
    """Write into a folder that holds files of others, over those of the same names."""
    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        from rich.markup import escape

        from bench.reproduction import RowVerdict, reproduce
        from bench.reproduction.writing import items_summary
        from bench.targets import check_target_folder

        check_target_folder(self.out, force=self.force, own=("table.json", "[A-D][0-9]*.json"))
        with progress_bar(quiet=self.json) as progress:
            result = reproduce(self.items, self.out, fresh=self.fresh, progress=progress)
        if self.json:
            emit(result.to_dict() | {"files": [str(path) for path in result.files]})
            return
        table = Table(
            "item",
            "quantity",
            "printed",
            "ours",
            "over ten seeds",
            "verdict",
            title=items_summary(result.results),
        )
        colours = {
            RowVerdict.FAILS: "red",
            RowVerdict.SHAPE: "yellow",
            RowVerdict.HOLDS: "",
            RowVerdict.NOT_COMPARABLE: "dim",
        }
        for made in result.results:
            for row in made.rows:
                cells = (made.identifier, *row.cells()[:4], row.verdict.value)
                table.add_row(*(escape(cell) for cell in cells), style=colours[row.verdict])
        Console().print(table)
        print(f"{result.seconds:.0f} s; open {result.files[0]} in a browser.")


@dataclass
class Campaign:
    """Draw many records from a plan into a Parquet data set. Stopped or killed, it goes on where it was."""

    plan: tyro.conf.Positional[Path]
    """The plan (TOML or JSON; see docs/campaign.md)."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("out/campaign")
    """Folder of the data set."""
    workers: int | None = None
    """Processes; 1 by default."""
    threads: int | None = None
    """Threads a process; all cores shared among the workers by default."""
    scheduler: str | None = None
    """Address of a dask scheduler, to run on many machines."""
    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.campaign import Progress, run_campaign

        with progress_bar(quiet=self.json) as show:

            def progress(state: Progress) -> None:
                told = f"{state.records} of {state.planned} records, {state.rate:.1f} a second, {state.left:.0f} s left"
                show(
                    f"{told}, {state.failed} failed" if state.failed else told,
                    state.records / max(state.planned, 1),
                )

            result = run_campaign(
                self.plan,
                self.out,
                workers=self.workers,
                threads=self.threads,
                scheduler=self.scheduler,
                progress=progress,
            )
        if self.json:
            emit(result.to_dict())
            return
        for line in result.found:
            Console(stderr=True, soft_wrap=True).print(
                f"note: {line}", style="yellow", markup=False, highlight=False
            )
        failed = f", {result.failed} failed and set aside" if result.failed else ""
        print(
            f"{result.folder}: {result.records} records{failed}, {result.size / 1e6:.1f} MB, {result.seconds:.1f} s"
        )
