"""Real files of laboratories and robots in eight formats, each read, written again as CSV, and read from that.

    python scripts/real_formats.py --data FOLDER [--json]

FOLDER holds the measured records that are not shipped. A diagnosis is a function of the samples: where these are the same to the last
digit, the verdict is (`scripts/same_formats.py` shows that of a whole case). The exit status is 1 where anything differs.
"""

from __future__ import annotations

import json
import sys
import tempfile
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import tyro

from bench.discrepancy.intake.logs import Log, log_of
from bench.record_files.reading import read_recording


@dataclass
class Args:
    """Hold real files against their CSV."""

    data: Path
    """Folder of the measured records that are not shipped."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class RealFile:
    """A file as a laboratory or a robot wrote it.

    Attributes:
        path: Beneath the folder of data.
        rate: Sample rate [Hz] where it has no time.
        columns: Lines of its arrays by name, of those that are tables.
    """

    path: str
    rate: float = 0.0
    columns: Mapping[str, str] = field(default_factory=dict)


FILES = {
    "JSON list of samples": RealFile("robots/bam_servos/original/xl330_2026-01-15_10h28m10.json"),
    "folder of command and state CSV": RealFile("robots/so101/original/chirp_sweep"),
    "rosbag2, SQLite": RealFile("robots/ur10/exciting"),
    "Parquet": RealFile("robots/so101/motions/spiral_motion.parquet"),
    "text table": RealFile("robots/double_pendulum/original/A0_0812_free_060143.csv"),
    "MAT 5": RealFile("silverbox/SNLS80mV.mat", 610.35, {"input": "V1", "output": "V2"}),
    "HDF5": RealFile(
        "bouc_wen_benchmark/train.h5", 750.0, {"force": "multisine/u[:, 0]", "displacement": "multisine/y[:, 0]"}
    ),
    "npz": RealFile(
        "friction_damper/1Hz20lbtension.npz", 512.0, {f"column {i}": f"data[:, {i}]" for i in range(6)}
    ),
}  # fmt: skip


class Held(NamedTuple):
    """A real file against its CSV: what it holds, and by how much of a channel's largest value the two differ at most."""

    format: str
    channels: int
    samples: int
    apart: float


def read(file: RealFile, path: Path) -> Log:
    """A file as a diagnosis reads it."""
    if not file.columns:
        return log_of(path, rate=file.rate)
    units = dict.fromkeys(file.columns, "1")
    return log_of(read_recording(path, columns=file.columns, units=units, sample_rate=file.rate))


def held(kind: str, file: RealFile, data: Path, folder: Path) -> Held:
    """One file against its CSV."""
    original = read(file, data / file.path)
    numeric = {
        name: values for name, values in original.arrays.items() if np.issubdtype(values.dtype, np.number)
    }
    path = folder / "again.csv"
    names = [f"c{i}" for i in range(len(numeric))]  # headings with brackets would be read as units
    table = np.column_stack([original.time, *numeric.values()])
    np.savetxt(path, table, delimiter=",", header=",".join(["time [s]", *names]), comments="", fmt="%.17g")
    again = log_of(path)
    apart = [
        float(np.max(np.abs(again.arrays[name] - values)) / max(np.max(np.abs(values)), 1e-300))
        for name, values in zip(names, numeric.values(), strict=True)
    ]
    return Held(kind, len(numeric), len(original.time), max(apart))


def main() -> None:
    """Print what differs."""
    asked = tyro.cli(Args, description=__doc__)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what is doubtful in the files is not the question here
        rows = [held(kind, file, asked.data, Path(folder)) for kind, file in FILES.items()]
    if asked.json:
        print(json.dumps([row._asdict() for row in rows], indent=1))
    else:
        for row in rows:
            print(f"{row.format}: {row.channels} channels of {row.samples} samples, {row.apart:.3g} apart")
    sys.exit(any(row.apart > 0.0 for row in rows))


if __name__ == "__main__":
    main()
