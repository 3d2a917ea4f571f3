"""The same verdict from every format: a case whose records are CSV, its records written in eight others, each diagnosed.

    python scripts/same_formats.py CASE [--only tdms hdf5 …] [--json]

CASE is a folder as `jointbench diagnose` reads it, its records in a format that tells its columns (CSV). Each format is written by its
own library, read by the one reader, and the whole verdict but its time is held against that from the folder as it is. The exit status
is 1 where anything differs.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy import diagnose, read_case
from bench.record_files import read_recording
from bench.record_files.plain_writing import write_record
from bench.recording import Recording

sys.path.insert(0, str(Path(__file__).resolve().parent))
from same_verdicts import differences

Writer = Callable[[Path, Recording], None]


def _table(record: Recording) -> dict[str, np.ndarray]:
    return {"time": record.time, **{name: record[name] for name in record.names}}


def hdf5(path: Path, record: Recording) -> None:
    """A data set a channel."""
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in _table(record).items():
            file[name] = values


def matlab_7_3(path: Path, record: Recording) -> None:
    """What MATLAB writes from 7.3 on: HDF5 behind a block of text, rows and columns exchanged."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in _table(record).items():
            file[name] = values[None, :]
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file")


def samples(path: Path, record: Recording) -> None:
    """A list of samples."""
    columns = _table(record)
    rows = [dict(zip(columns, map(float, row), strict=True)) for row in zip(*columns.values(), strict=True)]
    path.write_text(json.dumps({"samples": rows}), encoding="utf-8")


def labview(path: Path, record: Recording) -> None:
    """A LabVIEW measurement."""
    n, count = len(record.time), len(record.names)
    head = ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t."]
    head += ["***End_of_Header***\t", ""]
    head += [f"Channels\t{count}\t", "\t".join(["Samples", *[str(n)] * count]), "***End_of_Header***\t\t"]
    rows = ["\t".join(map(repr, map(float, row))) for row in zip(*_table(record).values(), strict=True)]
    path.write_text("\n".join([*head, "\t".join(["X_Value", *record.names, "Comment"]), *rows]) + "\n")


def tdms(path: Path, record: Recording) -> None:
    """National Instruments' TDMS, its clock in the properties of the channels."""
    import nptdms

    clock = {"wf_increment": 1.0 / record.sample_rate, "wf_start_offset": float(record.time[0])}
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(
            [nptdms.ChannelObject("run", name, np.array(record[name]), clock) for name in record.names]
        )


FORMATS: dict[str, tuple[str, Writer]] = {
    "parquet": (".parquet", write_record), "npz": (".npz", write_record), "mat 5": (".mat", write_record), "mat 7.3": (".mat", matlab_7_3),
    "hdf5": (".h5", hdf5), "json": (".json", samples), "lvm": (".lvm", labview), "tdms": (".tdms", tdms),
}  # fmt: skip
"""Format to suffix and writer."""


def rewritten(case: Path, kind: str, folder: Path) -> Path:
    """Write a case with its records in another format; everything else is copied."""
    suffix, write = FORMATS[kind]
    units = {
        name: entry.get("unit", "") for name, entry in json.loads((case / "nominal.json").read_text())["channels"].items()
    }  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    for file in sorted(path for path in case.iterdir() if path.is_file()):
        stem = file.name.partition(".")[0]
        if not stem.startswith(("identification", "validation")):
            shutil.copy(file, folder / file.name)
            continue
        told = {name: unit for name, unit in units.items() if name != "time"}
        write(folder / f"{stem}{suffix}", read_recording(file, units=told))
    return folder


def verdict_of(folder: Path) -> dict[str, Any]:
    """The verdict as JSON values, without its time."""
    told = diagnose(read_case(folder)).verdict.to_json()
    told.pop("seconds", None)
    return told


def main() -> None:
    """Print what differs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("case", type=Path)
    parser.add_argument("--only", nargs="*", choices=FORMATS, metavar="FORMAT", default=list(FORMATS))
    parser.add_argument("--json", action="store_true", help="print JSON")
    asked = parser.parse_args()
    plain = verdict_of(asked.case)
    found: dict[str, list[str]] = {}
    with tempfile.TemporaryDirectory() as root:
        for kind in asked.only:
            folder = rewritten(asked.case, kind, Path(root) / kind / asked.case.name)
            found[kind] = list(differences(plain, verdict_of(folder)))
            if not asked.json:
                print(
                    f"{kind:8s} {'the same' if not found[kind] else '; '.join(found[kind][:3])}", flush=True
                )
    if asked.json:
        named = [effect["name"] for effect in plain["named"]]
        print(json.dumps({"verdict": plain["verdict"], "named": named, "differences": found}, indent=1))
    sys.exit(any(found.values()))


if __name__ == "__main__":
    main()
