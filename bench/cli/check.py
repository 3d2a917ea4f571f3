"""The command that looks at records before any fit."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro
from rich.console import Console
from rich.table import Table

from bench.cli.console import emit
from bench.cli.paths import PRINTED

if TYPE_CHECKING:
    from bench.discrepancy.precheck.checking import Checked
    from bench.discrepancy.precheck.information import Told


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


def _tell(found: Checked, case: Path) -> None:
    from bench.discrepancy.precheck.information import WORDS
    from bench.discrepancy.precheck.settings import CheckSettings

    console = Console()

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    say(f"{case}: {found.word} ({found.seconds:.1f} s)")
    for doubt in found.doubts:
        say(f"- {doubt}")
    for note in found.notes:
        say(f"  {note}")
    if found.parameters:
        table = Table("nominal parameter", "with these records", "")
        for one in sorted(found.parameters, key=lambda told: WORDS.index(told.word)):
            table.add_row(one.name, one.word, one.text)
        console.print(table)
    if found.effects:
        console.print(_effects(found.effects, WORDS))
        say(
            f"Numbers: sigmas by which each shows where it changes a response by {100.0 * CheckSettings().matters:.0f} %; ~ where nominal "
            "parameters imitate it. What is not identifiable takes larger or slower motions. All of it in words: --json"
        )


def _effects(effects: Sequence[Told], words: Sequence[str]) -> Table:
    """Effects by how well the records tell them, in a column for each word, with their places."""
    table = Table("effect", *words)
    found: dict[str, list[Told]] = {}
    for one in effects:
        found.setdefault(one.name, []).append(one)
    for name, mine in found.items():
        cells = (", ".join(_short(one) for one in mine if one.word == word) for word in words)
        table.add_row(name, *cells)
    return table


def _short(one: Told) -> str:
    """Place and sigmas of an effect, a mark where nominal parameters imitate it."""
    sigmas = f"{one.figure:.1f}" if one.figure < 10.0 else f"{one.figure:.0f}"
    return f"{one.where} {'~' if one.imitable else ''}{sigmas if one.figure else ''}".strip()
