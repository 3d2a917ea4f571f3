"""The command that looks at records before any fit."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console
from rich.table import Table

from bench.cli.console import emit
from bench.cli.paths import PRINTED


@dataclass
class Check:
    """Look at a case in seconds, before any fit: faults of its records, and what they can tell.

    Exit status: 0 ready, 1 doubtful, 2 unusable. Example: jointbench check my-case
    """

    case: tyro.conf.Positional[Path]
    """Case folder: nominal.json and the records."""
    information: bool = True
    """Tell which parameters and effects the records identify."""
    json: Path | None = None
    """File for the result as JSON; "-", or nothing at the end, prints it."""
    force: bool = False
    """Overwrite a file that exists."""

    def __call__(self) -> None:
        """Run the command."""
        import json

        from bench.discrepancy.precheck.checking import check_folder
        from bench.files import json_values, write_text
        from bench.targets import check_targets

        check_targets(self.json, force=self.force)
        found = check_folder(self.case, informed=self.information)
        if self.json == PRINTED:
            emit(found.to_json())
        else:
            _tell(found, self.case)
            if self.json is not None:
                write_text(
                    self.json, json.dumps(json_values(found.to_json()), indent=1, ensure_ascii=False) + "\n"
                )
                print(f"written: {self.json}")
        if found.status:
            sys.exit(found.status)


def _tell(found, case: Path) -> None:  # type: ignore[no-untyped-def]
    console = Console()

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    say(f"{case}: {found.word} ({found.seconds:.1f} s)")
    for doubt in found.doubts:
        say(f"- {doubt}")
    for note in found.notes:
        say(f"  {note}")
    for title, entries in (("nominal parameters", found.parameters), ("effects", found.effects)):
        if not entries:
            continue
        table = Table(title, "where", "with these records", "")
        for one in sorted(entries, key=lambda e: ("identifiable", "weak", "not identifiable").index(e.word)):
            table.add_row(one.name, one.where, one.word, one.text)
        console.print(table)
