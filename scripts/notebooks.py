"""Run the tutorials' notebooks and keep what they show.

python scripts/notebooks.py                       # all of docs/tutorials, in place
python scripts/notebooks.py campaign --check      # only that they run
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import nbformat
import tyro
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

from bench.files import write_text

ROOT = Path(__file__).resolve().parent.parent
TUTORIALS = ROOT / "docs" / "tutorials"


@dataclass(frozen=True)
class Args:
    """Run the tutorials' notebooks.

    Attributes:
        names: Names of notebooks; all where none is given.
        check: Keep nothing.
    """

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    check: bool = False


def run(path: Path, *, keep: bool) -> None:
    """Run a notebook from the first cell to the last.

    Raises:
        CellExecutionError: A cell raised.
    """
    notebook = nbformat.read(path, as_version=4)
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    commands = str(Path(sys.executable).parent)  # where `jointbench` and `python` of this environment are
    os.environ["PATH"] = os.pathsep.join([commands, os.environ.get("PATH", "")])
    client = NotebookClient(notebook, timeout=600, kernel_name="python3", coalesce_streams=True)  # pyrefly: ignore[bad-argument-type]
    client.execute(cwd=str(path.parent))
    if not keep:
        return
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # times of day, which change with every run
    notebook.metadata.pop("language_info", None)
    write_text(path, nbformat.writes(notebook) + "\n")


def main(args: Args) -> int:
    """Run them."""
    paths = sorted(TUTORIALS.glob("*.ipynb"))
    chosen = [path for path in paths if not args.names or path.stem in args.names]
    failed = 0
    for path in chosen:
        try:
            run(path, keep=not args.check)
            print(f"{path.stem}: runs")
        except CellExecutionError as error:
            failed += 1
            print(f"{path.stem}: {error}", file=sys.stderr)
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Args)))
