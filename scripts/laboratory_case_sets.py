"""What sets of laboratory cases by different authors share: the command, and what it writes besides the cases.

Plants, laws, signals and loggers of every set are its author's own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from bench.files import write_text


@dataclass(frozen=True)
class SetArgs:
    """Write the cases, acceptance.json and README.md."""

    out: tyro.conf.Positional[Path]
    """Folder for the cases."""


def write_end(out: Path, count: int, overview: str, acceptance: Mapping[str, Any]) -> None:
    """Write what is told of a set and what is right of its cases, last of all.

    Args:
        out: Folder of the cases.
        count: How many there are.
        overview: Content of README.md.
        acceptance: Content of acceptance.json.
    """
    write_text(out / "README.md", overview)
    write_text(out / "acceptance.json", json.dumps(acceptance, indent=1) + "\n")
    print(f"{count} cases in {out}")
