"""The commands before the day in the laboratory: what would be found, and the signals that find more."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.table import Table

from bench.cli.console import emit, progress_bar


@dataclass
class Rehearse:
    """Put known effects into your own model, play the planned signals with the stated noise, and say from which size on each is found.

    CASE is a folder as `diagnose` reads it, with an MJCF of your own; of its records only the commands are used, so that planned ones
    (`jointbench design`) will do. What is done is kept in the output folder: a rehearsal that was stopped goes on where it was.

    Example: jointbench rehearse my-case -o rehearsal --effects coulomb_friction backlash:elbow
    """

    case: tyro.conf.Positional[Path]
    """Case folder: nominal.json, the MJCF, records or planned commands."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("rehearsal")
    """Folder for rehearsal.json and index.html."""
    effects: tuple[str, ...] = ()
    """Effects to put in, NAME at every place or NAME:PLACE; one of each family by default."""
    sizes: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01)
    """Sizes: the change of a response by the effect over the response's standard deviation."""
    seed: int = 0
    """Seed of true parameters and noise."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Begin anew where the folder holds a rehearsal."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy.case.reading import read_case
        from bench.discrepancy.rehearsal.page import rehearsal_page, table
        from bench.discrepancy.rehearsal.rehearsing import rehearse

        case = read_case(self.case, planned=True)
        self.output.mkdir(parents=True, exist_ok=True)
        with progress_bar(quiet=self.json) as show:
            done = rehearse(
                case, self.output, effects=self.effects, sizes=self.sizes, seed=self.seed, again=self.force, progress=show
            )  # fmt: skip
        rehearsal_page(done).write(self.output / "index.html")
        if self.json:
            emit(done.to_json())
            return
        header, rows = table(done)
        shown = Table(*header)
        for row in rows:
            shown.add_row(*row)
        Console().print(shown)
        print(f"nothing put in: {', '.join(done.false_alarms) or 'nothing named'}")
        for name in ("rehearsal.json", "index.html"):
            print(f"written: {self.output / name}")


@dataclass
class Design:
    """Design the signals for a case within its limits: those that tell most of its parameters and effects.

    CASE holds nominal.json and the MJCF; records are not needed. Limits stand in nominal.json, "limits": {CHANNEL: LARGEST} for commands
    and responses; of what is not stated there, records that the folder has say what was borne. Written are identification.csv,
    identification_2.csv and validation.csv with the commands alone, to be played, and rehearsed with `jointbench rehearse`.

    Example: jointbench design my-case -o my-signals --seconds 20
    """

    case: tyro.conf.Positional[Path]
    """Case folder: nominal.json and the MJCF."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Folder for the case with the signals: nominal.json, the MJCF and three CSV files."""
    seconds: float = 20.0
    """Length of each [s]."""
    rate: float = 0.0
    """Sample rate [Hz]; that of nominal.json, or of the records, by default."""
    effects: tuple[str, ...] = ()
    """Effects that they are to tell, NAME or NAME:PLACE; one of each family by default."""
    seed: int = 0
    """Seed of phases and noise."""
    json: bool = False
    """Print JSON."""
    force: bool = False
    """Overwrite a folder that exists."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.discrepancy.rehearsal.designed import write_design
        from bench.discrepancy.rehearsal.designing import design_signals
        from bench.targets import check_target_folder

        check_target_folder(self.output, force=self.force)
        with progress_bar(quiet=self.json) as show:
            made = design_signals(
                self.case, seconds=self.seconds, rate=self.rate, effects=self.effects, seed=self.seed, progress=show
            )  # fmt: skip
        written = write_design(made, self.case, self.output)
        if self.json:
            emit({"folder": str(self.output), "files": [path.name for path in written], **made.to_json()})
            return
        shown = Table("signal", "information [nat]", "peaks of commands", "peaks of responses")
        for one in made.tried:
            peaks = [
                ", ".join(f"{n} {v:.3g}" for n, v in part.items()) for part in (one.commands, one.responses)
            ]
            shown.add_row(
                ("* " if one.label in made.chosen else "  ") + one.label, f"{one.information:.2f}", *peaks
            )
        Console().print(shown)
        for path in written:
            print(f"written: {path}")
