"""Targets: record files of every format, cases over them, models, decks and units."""

from __future__ import annotations

import gzip
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from fuzzing.binary_records import (
    make_hdf5,
    make_mat,
    make_npz,
    make_parquet,
    spoil_bytes,
    spoil_mat,
    spoil_npz,
    spoil_parquet,
)
from fuzzing.documents import NOMINAL, Target, make_case, read_case, write
from fuzzing.models import make_deck, make_mjcf, read_deck, read_mjcf, spoil_deck, spoil_mjcf
from fuzzing.mutations import flipped
from fuzzing.signals import table

WORDS = ("nan", "inf", "-", "", "1e999", "1e-", "0x10", "1_000", "abc", "é", "\x00", '"', '"1', ",", ";", "\t", "9" * 400,
         "1,5", "2024-01-01", "12:00:00", "#", "%", "\ufeff", "\r", "-0", "1e308", "99999999999999999999")  # fmt: skip


def csv_text(rng: np.random.Generator) -> str:
    """The table in one of the dialects of the field."""
    delimiter, decimal = [(",", "."), (";", ","), ("\t", "."), (" ", "."), ("|", "."), (";", ".")][
        int(rng.integers(6))
    ]
    rows = [delimiter.join(f"{x:.7g}".replace(".", decimal) for x in row) for row in table()]
    heading = delimiter.join(("time", "force", "displacement"))
    if rng.random() < 0.3 and delimiter != " ":
        heading = delimiter.join(("time [s]", "force [N]", "displacement [mm]"))
    lines = [heading, *rows]
    if rng.random() < 0.3 and delimiter != " ":
        lines.insert(1, delimiter.join(("s", "N", "m")))
    if rng.random() < 0.3:
        lines[:0] = ["Title: a test", "Date: 2024/01/24", ""]
    return "\n".join(lines) + "\n"


def spoilt_text(text: str, rng: np.random.Generator) -> str:
    """A text with cells, lines or stretches of it changed."""
    lines = text.split("\n")
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(lines)))
        action = int(rng.integers(9))
        if action < 3:
            cells = lines[at].replace(";", ",").split(",")
            cells[int(rng.integers(len(cells)))] = str(rng.choice(WORDS))
            lines[at] = ",".join(cells)
        elif action == 3:
            del lines[at : at + int(rng.integers(1, 30))]
        elif action == 4:
            lines[at:at] = [lines[at]] * int(rng.integers(1, 5))
        elif action == 5:
            lines.insert(at, str(rng.choice(WORDS)) * int(rng.choice([1, 3, 1000, 100_000])))
        elif action == 6:
            lines[0] = lines[0].replace(
                "force", str(rng.choice(["Force", "time", "", "force [kN]", "f" * 5000, "force(((["]))
            )
        elif action == 7:
            lines[at] = lines[at] + ",;\t"[int(rng.integers(3))] * int(rng.integers(1, 2000))
        else:
            lines = ["".join(lines)[: int(rng.integers(1, 5000))]]
        lines = lines or [""]
    out = "\n".join(lines)
    return out[: int(rng.integers(len(out) + 1))] if rng.random() < 0.15 else out


def spoil_csv(folder: Path, rng: np.random.Generator) -> None:
    """Write a table of text, changed, in some encoding, gzipped or not."""
    for old in folder.glob("record.*"):
        old.unlink()
    text = csv_text(rng)
    if rng.random() < 0.9:
        text = spoilt_text(text, rng)
    content = text.encode(str(rng.choice(["utf-8", "utf-8-sig", "utf-16", "cp1252"])), "replace")
    if rng.random() < 0.25:
        content = flipped(content, rng)
    packed = rng.random() < 0.3
    if packed:
        content = gzip.compress(content)
        if rng.random() < 0.5:
            content = flipped(content, rng)
    (folder / f"record{rng.choice(['.csv', '.CSV', '.txt', '.tsv'])}{'.gz' if packed else ''}").write_bytes(
        content
    )


def read_record(folder: Path) -> None:
    """Read the record of a folder, by all columns, by names, and bridged."""
    from bench.errors import BenchError
    from bench.record_files import read_recording

    units = {"force": "N", "displacement": "m"}
    path = next(iter(sorted(folder.glob("record.*"))))
    refused: BenchError | None = None
    asked: tuple[dict[str, Any], ...] = (
        {},
        {"units": units, "columns": {name: name for name in units}, "gaps": "interpolate"},
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for options in asked:
            try:
                recording = read_recording(path, **options)
            except BenchError as error:
                refused = error
                continue
            assert np.isfinite(recording.values).all()
            assert np.isfinite(recording.time).all()
    if refused is not None:
        raise refused


def read_named(folder: Path) -> None:
    """Read the record of a folder that names its channels."""
    from bench.record_files import read_recording

    path = next(iter(sorted(folder.glob("record.*"))))
    options: dict[str, Any] = (
        {} if path.suffix == ".parquet" else {"units": {"force": "N", "displacement": "m"}}
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        recording = read_recording(path, **options)
    assert np.isfinite(recording.values).all()


def spoil_case_records(folder: Path, rng: np.random.Generator) -> None:
    """Another file in the place of one of a case's records."""
    name = str(rng.choice(["identification", "validation"]))
    for old in folder.glob(f"{name}.*"):
        old.unlink()
    kinds = (
        (make_npz, spoil_npz),
        (make_mat, spoil_mat),
        (make_hdf5, spoil_bytes("record.h5")),
        (make_parquet, spoil_parquet),
    )
    if rng.random() < 0.6:
        spoil_csv(folder, rng)
    else:
        make, spoil = kinds[int(rng.integers(len(kinds)))]
        make(folder)
        if rng.random() < 0.7:
            spoil(folder, rng)
    made = next(iter(folder.glob("record.*")))
    made.rename(folder / made.name.replace("record", name))


UNITS = ("m", "N m", "m/s^2", "deg", "rpm", "inch", "lbf", "kip", "g", "mm", "°", "µm", "%", "dB", "degC", "Nm", "(m)", "**", "^",
         "^9", "^-2",
         "/", "*", " ", "(", ")", "1", "0", ".", "9", "e", "\x00", "m" * 70, "a" * 40, "é", "[", "\n", "lambda", "__", "!")  # fmt: skip


def spoil_units(folder: Path, rng: np.random.Generator) -> None:
    """Write a text of pieces of units."""
    pieces = [str(rng.choice(UNITS)) for _ in range(int(rng.integers(1, 12)))]
    (folder / "unit.txt").write_text(str(rng.choice(["", " "])).join(pieces), encoding="utf-8")


def read_units(folder: Path) -> None:
    """Check a unit, and convert it."""
    from bench.recording.units import check_unit, conversion, si_unit

    unit = (folder / "unit.txt").read_text(encoding="utf-8")
    check_unit(unit)
    conversion(unit, si_unit(unit))


def _make_csv(folder: Path) -> None:
    np.savetxt(
        folder / "record.csv", table(), delimiter=",", header="time,force [N],displacement [m]", comments=""
    )


def _make_units(folder: Path) -> None:
    (folder / "unit.txt").write_text("m/s^2")


def _make_case(folder: Path) -> None:
    make_case(folder)
    write(folder / "nominal.json", {key: value for key, value in NOMINAL.items() if key != "sample_rate_hz"})


RECORD_TARGETS: dict[str, Target] = {
    "csv": Target(_make_csv, spoil_csv, read_record),
    "npz": Target(make_npz, spoil_npz, read_named),
    "mat": Target(make_mat, spoil_mat, read_named),
    "hdf5": Target(make_hdf5, spoil_bytes("record.h5"), read_named),
    "parquet": Target(make_parquet, spoil_parquet, read_named),
    "case": Target(_make_case, spoil_case_records, read_case),
    "mjcf": Target(make_mjcf, spoil_mjcf, read_mjcf),
    "nastran": Target(make_deck, spoil_deck, read_deck),
    "unit": Target(_make_units, spoil_units, read_units),
}
"""Targets by name."""
