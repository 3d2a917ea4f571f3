"""Code in a Python process of its own, with its largest resident memory: what a process did before does not count."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.timing import Row

TARGET_MEMORY = 1e9
"""Memory that long work may take [bytes]."""
PEAK = """
from pathlib import Path
print(next(line.split()[1] for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")))
"""
"""Prints the largest resident memory [KiB] by Linux; `getrusage` counts what the parent held when it started the process."""


def in_new_process(code: str) -> tuple[list[str], int]:
    """Lines that code prints, and its largest resident memory [bytes]; the repository's packages can be imported in it."""
    root = Path(__file__).parents[2]
    path = os.pathsep.join([str(root / "scripts"), str(root), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\n{PEAK}"],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": path},
    )
    *lines, peak = done.stdout.splitlines()
    return lines, 1024 * int(peak)


def memory_row(name: str, peaks: Sequence[int]) -> Row:
    """The largest of peaks of resident memory [bytes] against `TARGET_MEMORY`."""
    least, most = min(peaks) / TARGET_MEMORY, max(peaks) / TARGET_MEMORY
    return Row(
        f"peak memory, {name}",
        most,
        (least, most),
        "≤ 1",
        "largest resident memory / 1 GB",
        {"bytes": list(peaks)},
    )
