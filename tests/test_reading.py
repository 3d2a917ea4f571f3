"""One reader: what spreadsheets and loggers write, clocks that are not quite sound, files that claim more than they hold."""

from __future__ import annotations

import gzip
import json
import os
import struct
import sys
import time
import warnings
import zipfile
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from fuzz import run
from fuzzing.binary_records import make_hdf5, make_mat, make_npz, make_parquet
from fuzzing.products import PRODUCT_TARGETS
from fuzzing.records import RECORD_TARGETS

from bench.discrepancy import read_case
from bench.errors import BenchError, FileFormatError, ModelError, RecordingError, RecordWarning, UnitError
from bench.limits import ReadingLimits
from bench.nastran.bulk import read_deck
from bench.record_files import read_recording
from bench.recording.units import check_unit
from bench.rig import Rig

N = 600
STEP = 0.002
UNITS = {"force": "N", "x": "m"}


def signals(n: int = N) -> np.ndarray:
    """Time, and two smooth channels with a little noise ``(n, 3)``."""
    t = STEP * np.arange(n)
    rng = np.random.default_rng(4)
    force = np.sin(9.0 * t) + 0.4 * np.sin(23.0 * t + 1.0)
    x = 0.01 * np.cos(7.0 * t) + 0.003 * np.sin(17.0 * t)
    return np.column_stack([t, force + 1e-3 * rng.standard_normal(n), x + 1e-5 * rng.standard_normal(n)])


def text(table: np.ndarray, delimiter: str = ",", head: str | None = None) -> str:
    lines = [delimiter.join(("time", "force", "x")) if head is None else head]
    lines += [delimiter.join(f"{value:.9g}" for value in row) for row in table]
    return "\n".join(lines) + "\n"


def rows(change) -> str:
    lines = text(signals()).splitlines()
    return "\n".join([lines[0], *(change(k, line) for k, line in enumerate(lines[1:]))]) + "\n"


PLAIN = text(signals())
DIALECTS: dict[str, str | bytes] = {
    "semicolons, decimal commas, CRLF": PLAIN.replace(",", ";").replace(".", ",").replace("\n", "\r\n"),
    "semicolons, points": PLAIN.replace(",", ";"),
    "tabs": PLAIN.replace(",", "\t"),
    "tabs, decimal commas": PLAIN.replace(",", "\t").replace(".", ","),
    "bars": PLAIN.replace(",", "|"),
    "blanks": "\n".join("  " + line.replace(",", "   ") for line in PLAIN.splitlines()),
    "old Macintosh": PLAIN.replace("\n", "\r"),
    "byte-order mark": "\ufeff" + PLAIN,
    "UTF-16": PLAIN.encode("utf-16"),
    "quoted cells": "\n".join(",".join(f'"{c}"' for c in line.split(",")) for line in PLAIN.splitlines()),
    "quoted decimal commas": "\n".join(
        ",".join('"' + c.replace(".", ",") + '"' for c in line.split(",")) for line in PLAIN.splitlines()
    ),
    "units in headings": text(signals(), head="time [s],force [N],x [m]"),
    "row of units": text(signals(), head="time,force,x\ns,N,m"),
    "row of units in brackets": text(signals(), head="time,force,x\n[s],[N],[m]"),
    "delimiters at the ends": "\n".join(line + "," for line in PLAIN.splitlines()) + "\n",
    "delimiters at the ends but of the headings": PLAIN.splitlines()[0]
    + "\n"
    + "\n".join(line + "," for line in PLAIN.splitlines()[1:])
    + "\n",
    "preamble": "Title: table test\nDate: 2024/01/24\nSample rate, 500 Hz\n\n" + PLAIN,
    "preamble with as many cells": "Logger,12,5\nDate,2024,1\n" + PLAIN,
    "text and an index beside": "\n".join(
        [",time,force,x,label", *(f"{k},{line},run A" for k, line in enumerate(PLAIN.splitlines()[1:]))]
    )
    + "\n",
    "Windows encoding": "\n".join(
        ["time,force,x,Temp °C", *(line + ",21.5" for line in PLAIN.splitlines()[1:])]
    ).encode("cp1252"),
    "empty rows below": PLAIN + ",,\n,,\n",
    "milliseconds said": rows(lambda k, line: f"{2 * k}," + line.split(",", 1)[1]).replace("time", "time [ms]", 1),
    "milliseconds by name": rows(lambda k, line: f"{2 * k}," + line.split(",", 1)[1]).replace("time", "time_ms", 1),
    "ISO dates": rows(lambda k, line: f"2024-01-01T00:00:0{2 * k / 1000:.3f}," + line.split(",", 1)[1]),
    "dates with a zone": rows(lambda k, line: f"2024-01-01 00:00:0{2 * k / 1000:.3f}+01:00," + line.split(",", 1)[1]),
    "German dates": rows(lambda k, line: f"24.01.2024 10:00:0{2 * k / 1000:.3f}," + line.split(",", 1)[1]),
    "times of day": rows(lambda k, line: f"23:59:0{2 * k / 1000:.3f}," + line.split(",", 1)[1]),
}  # fmt: skip


@pytest.mark.parametrize("name", DIALECTS)
def test_every_dialect_gives_the_same_record(tmp_path, name, recwarn):
    content = DIALECTS[name]
    path = tmp_path / "a.CSV"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    read = read_recording(path, columns={k: k for k in UNITS}, units=UNITS)
    assert len(read) == N
    assert read.sample_rate == pytest.approx(500.0, rel=1e-12)
    np.testing.assert_allclose(read.values, signals()[:, 1:], rtol=1e-8)  # nine digits are printed
    assert [str(w.message) for w in recwarn if w.category is RecordWarning] == []


def test_nanoseconds_since_1970_are_seen_and_said(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(rows(lambda k, line: f"{1732500000000000000 + 2_000_000 * k}," + line.split(",", 1)[1]))
    with pytest.warns(RecordWarning, match="nanoseconds since 1970"):
        read = read_recording(path, units=UNITS)
    assert read.sample_rate == 500.0
    np.testing.assert_allclose(read.time, STEP * np.arange(N), rtol=1e-15)
    assert read.meta["source"]["start"] == "1732500000000000000 ns"


def test_a_cut_last_number_is_noticed_and_left_out(tmp_path):
    path = tmp_path / "a.csv"
    for cut, words in ((PLAIN[:-7], "fewer digits"), (PLAIN.rsplit(",", 1)[0], "2 of 3 cells")):
        path.write_text(cut)
        with pytest.warns(RecordWarning, match=words):
            assert len(read_recording(path, units=UNITS)) == N - 1
    path.write_text(PLAIN[:-1])  # a whole last line needs no line break
    assert len(read_recording(path, units=UNITS)) == N


# Clocks


def write_case(folder: Path, records: dict[str, str | bytes], nominal: dict | None = None) -> Path:
    document = {
        "rig": "sdof",
        "parameters": {
            "mass": {"value": 2.0, "std": 0.02, "unit": "kg"},
            "stiffness": {"value": 400.0, "std": 4.0, "unit": "N/m"},
        },
        "channels": {"force": {"unit": "N"}, "displacement": {"unit": "m"}},
    } | (nominal or {})
    folder.mkdir(exist_ok=True)
    (folder / "nominal.json").write_text(json.dumps(document))
    for name, content in records.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return folder


def as_case(table: np.ndarray, head: str = "time,force,displacement") -> str:
    return text(table, head=head)


def both(tmp_path: Path, table: np.ndarray):
    """What the two ways in make of a table: the notes of either, or the error."""
    path = tmp_path / "a.csv"
    path.write_text(text(table))
    told = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            read_recording(path, units=UNITS, gaps="interpolate")
        told.append(" ".join(str(w.message) for w in caught))
    except RecordingError as error:
        told.append(str(error))
    folder = write_case(
        tmp_path / "case", {f"{n}.csv": as_case(table) for n in ("identification", "validation")}
    )
    try:
        told.append(" ".join(read_case(folder).identification[0].notes))
    except RecordingError as error:
        told.append(str(error))
    return told


def jittered(level: float) -> np.ndarray:
    table = signals()
    late = np.random.default_rng(1).uniform(-level, level, N)
    late[50] = level
    table[:, 0] += STEP * late
    return table


CLOCKS = {
    "dropped": (np.delete(signals(), 300, axis=0), r"1 sample missing \(1 after t = 0.598 s\): bridged"),
    "long dropout": (np.delete(signals(), np.arange(300, 320), axis=0), "20 successive samples are lost after t = 0.598 s"),
    "hidden dropout": (
        np.column_stack([signals()[:-20, 0], np.delete(signals(), np.arange(300, 320), axis=0)[:, 1:]]),
        "all channels jump at t = 0.6 s",
    ),
    "jitter": (jittered(0.2), "jitters by up to 20[.0-9]* % of a step .* interpolated onto a uniform clock of 500 Hz"),
    "much jitter": (jittered(0.4), "the clock is not uniform"),
    "backwards": (signals()[[*range(300), 301, 300, *range(302, N)]], "goes backwards"),
    "twice": (signals()[[*range(300), 299, *range(300, N)]], "comes twice"),
}  # fmt: skip


@pytest.mark.parametrize("name", CLOCKS)
def test_both_ways_in_say_the_same_of_a_clock(tmp_path, name):
    import re

    table, words = CLOCKS[name]
    for told in both(tmp_path, table):
        assert re.search(words, told), told


def test_jitter_is_interpolated_to_the_signal(tmp_path):
    level = 0.2
    t = STEP * np.arange(N)
    late = t + STEP * np.random.default_rng(1).uniform(-level, level, N)
    table = np.column_stack([late, np.sin(30.0 * late), np.cos(20.0 * late)])
    (tmp_path / "a.csv").write_text(
        "\n".join(["time,force,x", *(",".join(f"{v:.12g}" for v in row) for row in table)]) + "\n"
    )
    with pytest.warns(RecordWarning, match="jitters"):
        read = read_recording(tmp_path / "a.csv", units=UNITS)
    # a cubic spline over steps of at most 1.4 h errs by 5/384 (30 h)^4 of the amplitude, and by more at the two ends
    at = slice(5, -5)
    # the rate is fitted and the clock begins at the first sample, both as exact as the jitter allows: no drift is compared
    np.testing.assert_allclose(
        read["force"][at], np.sin(30.0 * read.time[at]), atol=20 * 5 / 384 * (1.4 * 30 * STEP) ** 4
    )


def test_rounded_times_are_no_jitter(tmp_path):
    t = np.arange(N) / 1024.0
    (tmp_path / "a.csv").write_text(
        "\n".join(["time,force [N]", *(f"{at:.4f},{np.sin(at):.9f}" for at in t)]) + "\n"
    )
    with pytest.warns(RecordWarning, match=r"rounded to 0.0001 s, .* 1024 Hz"):
        read = read_recording(tmp_path / "a.csv")
    np.testing.assert_allclose(read["force"], np.sin(t), atol=1e-9)


def test_smooth_records_have_no_hidden_dropouts(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(PLAIN)
    assert "warnings" not in read_recording(path, units=UNITS).meta


# Cases


def test_a_case_reads_every_format(tmp_path):
    sound = as_case(signals())
    for make, name in ((make_npz, "npz"), (make_mat, "mat"), (make_hdf5, "h5"), (make_parquet, "parquet")):
        folder = write_case(tmp_path / name, {"validation.csv": sound})
        make(folder)
        (folder / f"record.{name}").rename(folder / f"identification.{name}")
        case = read_case(folder)
        assert case.identification[0].step == 0.01
        assert len(case.identification[0]) == 400
    folder = write_case(
        tmp_path / "two", {"identification.csv": sound, "identification.tsv": sound, "validation.csv": sound}
    )
    with pytest.raises(FileFormatError, match="two files of one record"):
        read_case(folder)


def test_headings_of_other_units_are_converted_or_refused(tmp_path):
    table = signals()
    sound = as_case(table)
    scaled = table * [1.0, 1e-3, 1e3]
    folder = write_case(
        tmp_path / "a",
        {
            "identification.csv": as_case(scaled, "time [s],force [kN],displacement [mm]"),
            "validation.csv": sound,
        },
    )
    case = read_case(folder)
    for name in ("force", "displacement"):
        np.testing.assert_allclose(
            case.identification[0].values[name], case.validation[0].values[name], rtol=1e-7
        )
    wrong = write_case(
        tmp_path / "b",
        {"identification.csv": as_case(table, "time,force [V],displacement"), "validation.csv": sound},
    )
    with pytest.raises(UnitError, match=r"heading says that 'force' is in V, nominal\.json in N"):
        read_case(wrong)


def test_times_in_milliseconds_are_suspected_and_can_be_stated(tmp_path):
    table = signals() * [1000.0, 1.0, 1.0]
    records = {f"{name}.csv": as_case(table) for name in ("identification", "validation")}
    with pytest.raises(RecordingError, match=r"time in ms\? .*nominal.json"):
        read_case(write_case(tmp_path / "a", records))
    channels = {"force": {"unit": "N"}, "displacement": {"unit": "m"}, "time": {"unit": "ms"}}
    case = read_case(write_case(tmp_path / "b", records, {"channels": channels}))
    assert case.identification[0].step == pytest.approx(STEP, rel=1e-12)
    fast = {f"{n}.csv": as_case(signals() * [100.0, 1.0, 1.0]) for n in ("identification", "validation")}
    with pytest.raises(RecordingError, match=r"5000 Hz, the times 5 Hz: time in ms\?"):
        read_case(write_case(tmp_path / "c", fast, {"sample_rate_hz": 5000.0}))


# Limits


def mat(*elements: bytes) -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"".join(elements)


def tagged(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def array(kind: int, shape: tuple[int, int], body: bytes, name: bytes = b"x") -> bytes:
    head = tagged(6, struct.pack("<II", kind, 0)) + tagged(5, struct.pack("<2i", *shape)) + tagged(1, name)
    return tagged(14, head + body)


def nested(depth: int) -> bytes:
    inner = array(6, (1, 1), tagged(9, struct.pack("<d", 1.0)), b"")
    for _ in range(depth):
        inner = array(1, (1, 1), inner, b"")
    return inner


def npz_claim(shape: str) -> bytes:
    import io

    stream = io.BytesIO()
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(
            "time.npy", b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode() + bytes(64)
        )
    return stream.getvalue()


SMALL = ReadingLimits(numbers=100_000, text_bytes=2**23, line_bytes=2**16)
"""Limits that small bombs reach."""
BOMBS: dict[str, tuple[bytes, str]] = {
    "zeros.csv.gz": (gzip.compress(bytes(2**24)), "no text file"),
    "one line.csv.gz": (gzip.compress(b"0" * 2**24), "line longer"),
    "rows.csv.gz": (gzip.compress(b"time,x\n" + b"0,0\n" * 2**19), "more than 100000 numbers"),
    "blanks.csv.gz": (gzip.compress(b"time,x\n0,1\n" + b"\n" * 2**24), "of text"),
    "cut.csv.gz": (gzip.compress(PLAIN.encode())[:-20], "no complete gzip"),
    "claim.npz": (npz_claim("(1000000000000,)"), "claims an array"),
    "short.npz": (npz_claim("(1000,)"), "claims 8 kB and holds"),
    "cells.mat": (mat(array(1, (20000, 20000), b"")), "claims 400000000 values"),
    "pointer.mat": (mat(array(6, (1, 1), tagged(0, bytes(8)))), "values of type 0"),
    "deep.mat": (mat(nested(3000)), "nested more than 32 deep"),
    "packed.mat": (mat(tagged(15, zlib.compress(bytes(2**22)))), "unpacks to more"),
    "version 4.mat": (struct.pack("<5i", 0, 2**30, 2**30, 0, 2) + b"x\0", "values in"),
}


@pytest.mark.parametrize("name", BOMBS)
def test_files_that_claim_more_than_they_hold_are_refused(tmp_path, name):
    content, words = BOMBS[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FileFormatError, match=words):
        read_recording(tmp_path / name, units={"x": "m"}, limits=SMALL)


def test_hdf5_takes_no_values_from_elsewhere(tmp_path):
    (tmp_path / "secret").write_bytes(bytes(64))
    t = np.arange(64) / 100.0

    def external(file):
        file.create_dataset("force", shape=(64,), dtype="u1", external=[(str(tmp_path / "secret"), 0, 64)])

    def virtual(file):
        layout = h5py.VirtualLayout(shape=(64,), dtype="f8")
        layout[:] = h5py.VirtualSource("other.h5", "x", shape=(64,))
        file.create_virtual_dataset("force", layout)

    def claims(file):
        file.create_dataset("force", shape=(10**12,), dtype="f8", chunks=(1000,))

    def deep(file):
        for _ in range(50):
            file = file.create_group("g")

    def linked(file):
        file["force"] = h5py.ExternalLink("other.h5", "x")

    for make, words in (
        (external, "external storage"), (virtual, "virtual data set"), (claims, "claims a data set 'force' of 8 TB"),
        (deep, "nests them more than 32 deep"), (linked, "no column of numbers"),
    ):  # fmt: skip
        path = tmp_path / f"{make.__name__}.h5"
        with h5py.File(path, "w") as file:
            file["time"] = t
            make(file)
        with pytest.raises(BenchError, match=words):
            read_recording(path, units={"force": "N"})


def test_pipes_devices_and_folders_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.csv").mkdir()
    for path, words in ((tmp_path / "pipe.csv", "a pipe"), (tmp_path / "folder.csv", "a folder")):
        with pytest.raises(FileFormatError, match=words):
            read_recording(path)
    folder = write_case(tmp_path / "case", {"validation.csv": as_case(signals())})
    os.mkfifo(folder / "identification.csv")
    with pytest.raises(FileFormatError, match="a pipe"):
        read_case(folder)
    os.mkfifo(tmp_path / "model.xml")
    with pytest.raises(ModelError, match="a pipe"):
        Rig.from_file(tmp_path / "model.xml")


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        ('<include file="model.xml"/>', "includes itself"),
        ('<include file="../other.xml"/>', "outside its folder"),
        ('<include file="link.xml"/>', "outside its folder"),
        ('<include file="fan.xml"/>', "more than 100 files"),
        ('<asset><mesh name="m" file="pipe.stl"/></asset>', "no regular file"),
        (
            '<worldbody><replicate count="100000"><replicate count="100000"><body/></replicate></replicate></worldbody>',
            "'replicate'",
        ),
        ('<asset><hfield name="h" nrow="1000000" ncol="1000000" size="1 1 1 1"/></asset>', "'hfield'"),
        ('<size memory="1000G"/>', "memory"),
    ],
)
def test_models_that_leave_their_folder_or_never_end_are_refused(tmp_path, inside, words):
    folder = tmp_path / "model"
    folder.mkdir()
    (tmp_path / "other.xml").write_text("<mujoco/>")
    (folder / "link.xml").symlink_to(tmp_path / "other.xml")
    fans = "".join(f'<include file="fan{k}.xml"/>' for k in range(9))
    (folder / "fan.xml").write_text(f"<mujoco>{fans}</mujoco>")
    leaves = "".join(f'<include file="leaf{j}.xml"/>' for j in range(20))
    for k in range(9):
        (folder / f"fan{k}.xml").write_text(f"<mujoco>{leaves}</mujoco>")
    for j in range(20):
        (folder / f"leaf{j}.xml").write_text("<mujoco/>")
    os.mkfifo(folder / "pipe.stl")
    (folder / "model.xml").write_text(f"<mujoco>{inside}</mujoco>")
    with pytest.raises(ModelError, match=words):
        Rig.from_file(folder / "model.xml")


def test_decks_that_leave_their_folder_or_never_end_are_refused(tmp_path):
    folder = tmp_path / "deck"
    folder.mkdir()
    (tmp_path / "other.bdf").write_text("SPOINT,1\n")
    (folder / "fan.bdf").write_text("INCLUDE 'leaf.bdf'\n" * 200)
    (folder / "leaf.bdf").write_text("SPOINT,1\n")
    for lines, words in (
        ("INCLUDE 'main.bdf'", "includes itself"),
        ("INCLUDE '../other.bdf'", "outside the folder"),
        ("INCLUDE 'fan.bdf'", "includes 100 files"),
        ("SPOINT,1,THRU,99999999", "at most 2000000 points"),
    ):
        (folder / "main.bdf").write_text(lines + "\n")
        with pytest.raises(FileFormatError, match=words):
            read_deck(folder / "main.bdf")


def test_a_long_unit_is_refused_at_once():
    began = time.perf_counter()
    with pytest.raises(UnitError, match="has 100000 characters"):
        check_unit("a" * 100_000)
    assert time.perf_counter() - began < 1.0


def test_a_version_4_file_is_read(tmp_path):
    t, force, x = signals().T
    scipy.io.savemat(tmp_path / "a.mat", {"time": t, "force": force, "x": x}, format="4")
    np.testing.assert_array_equal(read_recording(tmp_path / "a.mat", units=UNITS)["x"], x)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "count"), [*((name, 25) for name in RECORD_TARGETS), *((name, 6) for name in PRODUCT_TARGETS)]
)
def test_the_fuzzer_finds_nothing_in_a_short_run(name, count):
    assert run(name, count, seed=11) == []
