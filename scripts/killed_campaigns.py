"""Kill campaigns at random moments, resume them, and hold their bytes against those of a campaign that nothing disturbed.

    python scripts/killed_campaigns.py --kills 200 [--seed 1] [--json]

Each campaign runs as the command that a user gives, is killed (SIGKILL, its whole group) somewhere between its first and last write, and
resumed until it ends. Every file is compared but the journal and the manifest, which tell of the stops. Exit status 1 where one differs.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console

PLAN = """
name = "killed"
seed = 2006
records = 60
records_per_part = 4
duration = 10.0
sample_rate = 1000.0
channels = ["shaker", "displacement", "velocity"]
[[rigs]]
rig = "sdof"
structure.stiffness.carriage = { log_uniform = [800.0, 3000.0] }
[[rigs.elements]]
law = "gap"
joints = ["carriage"]
parameters.clearance = { uniform = [0.001, 0.008] }
[[excitations]]
signals.shaker = { type = "band_limited_noise", cutoff = 40.0, rms = 20.0 }
"""
TOLD = ("journal", "manifest")
"""Files that tell when a campaign was stopped."""
EARLIEST, LATEST = 0.3, 1.0
"""Parts of an undisturbed run between which a kill falls: it begins with the imports, in which nothing is written."""


@dataclass
class Args:
    """Kill and resume."""

    kills: int = 200
    """How often, at least."""
    seed: int = 1
    """Of the moments."""
    json: bool = False
    """Print JSON."""


def run(plan: Path, out: Path, until: float | None) -> bool:
    """Run or resume a campaign; whether it was killed after some seconds."""
    command = [str(Path(sys.executable).parent / "jointbench"), "campaign", str(plan), "--out", str(out)]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        _, said = process.communicate(timeout=until)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return True
    if process.returncode:
        raise SystemExit(f"killed_campaigns: the campaign ended with {process.returncode}: {said.strip()}")
    return False


def digests(folder: Path) -> dict[str, str]:
    """Hash of every file but those that tell of the stops."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(name in path.name for name in TOLD)
    }


def main(args: Args) -> int:
    """Run the command."""
    rng, kills, campaigns, differ = np.random.default_rng(args.seed), 0, 0, 0
    with tempfile.TemporaryDirectory() as temporary, Console(stderr=True).status("") as status:
        folder = Path(temporary)
        plan = folder / "plan.toml"
        plan.write_text(PLAN, encoding="utf-8")
        run(plan, folder / "first", None)  # whatever is compiled is compiled now
        began = time.perf_counter()
        run(plan, folder / "whole", None)
        whole, reference = time.perf_counter() - began, digests(folder / "whole")
        while kills < args.kills:
            out = folder / f"campaign_{campaigns}"
            while run(plan, out, whole * rng.uniform(EARLIEST, LATEST)):
                kills += 1
            campaigns += 1
            differ += digests(out) != reference
            status.update(f"{kills} kills of {campaigns} campaigns, {differ} differ")
    told = {"campaigns": campaigns, "kills": kills, "differ": differ}
    print(json.dumps(told) if args.json else f"{kills} kills of {campaigns} campaigns, {differ} differ")
    return int(differ > 0)


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Args, description=__doc__)))
