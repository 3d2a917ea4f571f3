"""The command `jointbench`: parse, call, print, save."""

from __future__ import annotations

import codecs
import sys
import warnings
from collections.abc import Callable
from dataclasses import fields
from io import TextIOWrapper
from itertools import pairwise
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

import bench
from bench import __version__, kernel_cache
from bench.cli.application import Apply
from bench.cli.check import Check
from bench.cli.console import Terminated, terminable
from bench.cli.diagnose import Diagnose
from bench.cli.diagnosis import Blind
from bench.cli.excite import Excite
from bench.cli.init import Init
from bench.cli.installation import Doctor, Example
from bench.cli.joints import Compare, Export, Identify, Swap
from bench.cli.monitoring import Monitor
from bench.cli.paths import PRINTED
from bench.cli.records import Convert, Plot
from bench.cli.rehearsal import Design, Rehearse
from bench.cli.rigs import Demo, Laws, Simulate, View
from bench.cli.schema import Schema
from bench.cli.studies import Campaign, Reproduce
from bench.errors import BenchError

COMMANDS: dict[str, type] = {
    "demo": Demo,
    "laws": Laws,
    "simulate": Simulate,
    "view": View,
    "identify": Identify,
    "swap": Swap,
    "compare": Compare,
    "export": Export,
    "plot": Plot,
    "convert": Convert,
    "excite": Excite,
    "init": Init,
    "check": Check,
    "design": Design,
    "rehearse": Rehearse,
    "diagnose": Diagnose,
    "apply": Apply,
    "blind": Blind,
    "monitor": Monitor,
    "reproduce": Reproduce,
    "campaign": Campaign,
    "schema": Schema,
    "example": Example,
    "doctor": Doctor,
}


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    Console(stderr=True, soft_wrap=True).print(
        f"note: {message}", style="yellow", markup=False, highlight=False
    )


def _speak_unicode() -> None:
    """Have both streams write UTF-8 where the locale (LANG=C, PYTHONIOENCODING) says ASCII: results have units and Greek letters."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            ascii_only = codecs.lookup(stream.encoding).name == "ascii"
            # what another locale's alphabet lacks is told as its number rather than by a traceback
            stream.reconfigure(encoding="utf-8" if ascii_only else None, errors="backslashreplace")


def _announce_compilation(command: object) -> None:
    """Say once why the first command on an installation takes longer than the same one later."""
    quick = (Laws, Schema, Example, Doctor)
    if not isinstance(command, quick) and kernel_cache.is_empty(Path(bench.__file__).parent):
        print("jointbench: first run, force laws and fits are compiled once", file=sys.stderr)


def _json_printed(arguments: list[str]) -> list[str]:
    """Arguments in which a ``--json`` without a file asks for standard output, as it does of commands that write none."""
    command = COMMANDS.get(arguments[0]) if arguments else None
    if command is None or all(field.name != "json" or field.default is not None for field in fields(command)):
        return arguments
    told = []
    for argument, following in pairwise((*arguments, "--")):
        bare = argument == "--json" and following.startswith("-") and following != str(PRINTED)
        told += [argument, str(PRINTED)] if bare else [argument]
    return told


def main(argv: list[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0 done, 2 refused with a message, 130 stopped by hand, 143 by the system."""
    warnings.showwarning = _show_warning
    _speak_unicode()
    arguments = sys.argv[1:] if argv is None else argv
    if arguments == ["--version"]:
        print(f"jointbench {__version__}")
        return 0
    try:
        command: Callable[[], None] = tyro.extras.subcommand_cli_from_dict(  # pyrefly: ignore[no-matching-overload]
            COMMANDS,
            prog="jointbench",
            description="A MuJoCo virtual test bench for nonlinear joints. --version prints the version.",
            args=_json_printed(arguments),
        )
        _announce_compilation(command)
        with terminable():
            command()
    except (BenchError, OSError) as error:
        Console(stderr=True, soft_wrap=True).print(
            f"jointbench: {error}", style="red", markup=False, highlight=False
        )
        return 2
    except KeyboardInterrupt as stopped:
        print("jointbench: stopped", file=sys.stderr)
        return stopped.status if isinstance(stopped, Terminated) else 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
