"""Commands on rigs: the demo, the catalogue of laws, simulation, and the viewer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table

from bench.cli.console import emit, progress_bar


@dataclass
class Demo:
    """Identify a real friction damper and the deck's joint, swap the models in, compare on unseen tests.

    Writes index.html, a rerun recording and Parquet records.
    """

    out: Path = Path("out/demo")
    """Folder for the results."""
    force: bool = False
    """Overwrite the results of an earlier run."""
    json: bool = False
    """Print the figures as JSON instead of a table."""

    def __call__(self) -> None:
        """Run the command."""
        from bench import demo
        from bench.demo.report import demo_summary, write
        from bench.targets import check_target_folder

        check_target_folder(self.out, force=self.force)
        with progress_bar(quiet=self.json) as progress:
            result = demo.compute(progress)
            files = write(result, self.out, progress)
        if self.json:
            emit(result.to_dict() | {"files": [str(path) for path in files]})
            return
        console = Console()
        for table in demo_summary(result):
            console.print(table)
        console.print(f"{result.seconds:.0f} s. Open {files[0]} in a browser, and {files[1]} with `rerun`.")


@dataclass
class Laws:
    """List the force laws, or describe one."""

    name: tyro.conf.Positional[str] = ""
    """A law to describe in full."""
    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        from bench.laws import LAWS, describe, find_law

        laws = [find_law(self.name)] if self.name else list(LAWS.values())
        if self.json:
            emit([describe(law) for law in laws])
            return
        console = Console()
        if not self.name:
            table = Table("law", "equation", "parameters", "states", title="Force laws")
            for law in laws:
                table.add_row(law.name, law.equation, ", ".join(law.parameter_names), ", ".join(law.states))
            console.print(table)
            return
        law = laws[0]
        console.print(f"[bold]{law.name}[/bold]   {law.equation}\n{law.reference}", highlight=False)
        table = Table("parameter", "unit", "default", "bounds", "meaning")
        for p in law.parameters:
            unit = p.unit if p.rotational in {None, p.unit} else f"{p.unit} or {p.rotational}"
            table.add_row(p.name, unit, f"{p.default:g}", f"{p.bounds[0]:g} … {p.bounds[1]:g}", p.description)
        console.print(table)
        console.print(describe(law)["documentation"], markup=False, highlight=False)


@dataclass
class Simulate:
    """Simulate a rig described by a TOML or JSON file and write its record."""

    configuration: tyro.conf.Positional[Path]
    """Rig, elements and excitation (see docs/configuration.md)."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("record.parquet")
    """The record to write: .parquet, which keeps everything, .csv, .npz or .mat."""
    force: bool = False
    """Overwrite a record that exists."""
    seed: int | None = None
    """Seed of the excitation; that of the file by default, or 0."""
    json: bool = False
    """Print JSON."""

    def __call__(self) -> None:
        """Run the command."""
        import numpy as np

        from bench.record_files.plain_writing import write_record
        from bench.rig import simulate
        from bench.targets import check_targets

        check_targets(self.out, force=self.force)
        rig, excitation, seed = _configured(self.configuration)
        rng = np.random.default_rng(seed if self.seed is None else self.seed)
        record = simulate(rig, excitation, rng=rng)
        write_record(self.out, record)
        rows = [
            {
                "channel": c.name,
                "unit": c.unit,
                "min": float(record[c.name].min()),
                "max": float(record[c.name].max()),
            }
            for c in record.channels
        ]
        if self.json:
            emit({"file": str(self.out), "samples": len(record.time), "channels": rows})
            return
        table = Table("channel", "unit", "min", "max", title=f"{self.out}: {len(record.time)} samples")
        for row in rows:
            table.add_row(row["channel"], row["unit"], f"{row['min']:.5g}", f"{row['max']:.5g}")
        Console().print(table)


@dataclass
class View:
    """Log rigs moving in 3-D, their channels, loops and contact bands, side by side, to rerun."""

    configurations: tyro.conf.Positional[tuple[Path, ...]]
    """One rig, or several to be compared (the first is the truth); the first one's excitation drives all."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to save (.rrd); opens the viewer where not given."""
    force: bool = False
    """Overwrite a file that exists."""
    seed: int | None = None
    """Seed of the excitation; that of the file by default, or 0."""

    def __call__(self) -> None:
        """Run the command."""
        import numpy as np

        from bench.errors import ParameterError
        from bench.rerun_log import log_comparison
        from bench.rig import simulate
        from bench.targets import check_targets

        check_targets(self.out, force=self.force)
        if not self.configurations:
            raise ParameterError(
                "give at least one rig configuration (a TOML or JSON file; see docs/configuration.md)"
            )
        _, excitation, seed = _configured(self.configurations[0])
        seed = seed if self.seed is None else self.seed
        rigs = {path.stem: _configured(path, need_excitation=False)[0] for path in self.configurations}
        records = {
            name: simulate(rig, excitation, rng=np.random.default_rng(seed)) for name, rig in rigs.items()
        }
        log_comparison(self.out, rigs, records)
        if self.out is not None:
            print(f"{self.out}: open it with `rerun {self.out}`")


def _configured(path: Path, *, need_excitation: bool = True) -> tuple[Any, Any, int]:
    """Rig, excitation and seed of a file."""
    from bench.errors import ParameterError
    from bench.rig.configuration import read_rig

    document, rig = read_rig(path)
    if document.excitation is None and need_excitation:
        raise ParameterError(
            f"{path} has no [excitation]; say what drives the rig (see docs/configuration.md)"
        )
    return rig, document.drive, document.seed or 0
