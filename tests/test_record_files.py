"""Record files: lossless round trips, foreign formats, and every way a file can be wrong; the shipped records."""

import gzip
import shutil
import subprocess
import sys
from dataclasses import replace

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bench.errors import FileFormatError, RecordingError, UnitError, UnknownNameError
from bench.files import SYSTEM, OutputError
from bench.record_files import ColumnMap, read_recording, write_recording
from bench.recording import Recording

MEASURED = ColumnMap(
    columns={"x": "data[:, 1]", "f": "data[:, 2]"},
    units={"x": "inch", "f": "kip"},
    quantities={"x": "displacement", "f": "force"},
    roles={"x": "prescribed", "f": "measured"},
    time="data[:, 0]",
)


def record(n=200, **options):
    rng = np.random.default_rng(5)
    return Recording.from_arrays(
        np.arange(n) / 1024.0,
        {"displacement": rng.standard_normal(n), "Kraft [kN]": rng.standard_normal(n) * 1e-300},
        units={"displacement": "inch", "Kraft [kN]": "kN"},
        quantities={"displacement": "displacement", "Kraft [kN]": "force"},
        roles={"Kraft [kN]": "measured"},
        noise_std={"displacement": 0.1},
        settle=0.01,
        meta={"rig": "Prüfstand", "seeds": [1, 2], "theta": 0.1, "none": None},
        **options,
    )


def table(n=50, rate=100.0):
    t = np.arange(n) / rate
    return np.column_stack([t, np.sin(t), 2.0 * np.cos(t)])


# The format of the bench


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("records")


@given(
    values=arrays(
        np.float64,
        st.tuples(st.integers(2, 30), st.integers(0, 3)),
        elements=st.floats(allow_nan=False, allow_infinity=False),
    ),
    start=st.floats(-1e3, 1e3),
    rate=st.floats(1e-3, 1e6),
)
@settings(max_examples=60, deadline=None)
def test_round_trip_is_exact_to_the_bit(folder, values, start, rate):
    if 1e3 * rate * 2.3e-16 > 1e-4:  # a clock whose start swallows its steps is no clock
        start = 0.0
    names = [f"c{i}" for i in range(values.shape[1])]
    written = Recording.from_arrays(
        start + np.arange(len(values)) / rate,
        dict(zip(names, values.T, strict=True)),
        units=dict.fromkeys(names, "N"),
        sample_rate=rate,
    )
    read = read_recording(write_recording(folder / "trip.parquet", written))
    assert read == written
    assert read.values.tobytes(order="F") == written.values.tobytes(order="F")  # -0.0 stays -0.0
    assert read.time.tobytes() == written.time.tobytes()
    assert read.content_hash == written.content_hash


def test_round_trip_keeps_descriptions(tmp_path):
    written = record()
    read = read_recording(write_recording(tmp_path / "a.parquet", written))
    assert read == written
    assert read.channels == written.channels
    assert read.meta == written.meta
    again = read_recording(tmp_path / "a.parquet", settle=0.05, meta={"operator": "N. N."})
    assert again.settle == 0.05
    assert again.meta == {**written.meta, "operator": "N. N."}


def test_other_tools_read_it(tmp_path):
    written = record()
    found = pq.read_table(write_recording(tmp_path / "a.parquet", written))
    assert found.column_names == ["time", "displacement", "Kraft [kN]"]
    np.testing.assert_array_equal(found["Kraft [kN]"].to_numpy(), written["Kraft [kN]"])
    np.testing.assert_array_equal(found["time"].to_numpy(), written.time)
    assert found.schema.field("displacement").metadata == {b"unit": b"inch"}


def test_writing_is_atomic(tmp_path, monkeypatch):
    path = write_recording(tmp_path / "a.parquet", record())
    before = path.read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    for broken in ("fsync", "replace"):
        with monkeypatch.context() as patch:
            patch.setattr("bench.files.SYSTEM", replace(SYSTEM, **{broken: full}))
            with pytest.raises(OSError, match="No space left"):
                write_recording(path, record(300))
        assert path.read_bytes() == before
        assert [file.name for file in tmp_path.iterdir()] == ["a.parquet"]
    write_recording(path, record(300))
    assert len(read_recording(path)) == 300
    with pytest.raises(OutputError, match="cannot write"):
        write_recording(tmp_path / "a.parquet" / "b.parquet", record())


def test_same_record_same_bytes(tmp_path):
    one, two = (write_recording(tmp_path / name, record()) for name in ("1.parquet", "2.parquet"))
    assert one.read_bytes() == two.read_bytes()


def test_only_parquet_is_written(tmp_path):
    with pytest.raises(FileFormatError, match=r"'a.csv' the suffix .parquet"):
        write_recording(tmp_path / "a.csv", record())


def test_damage_anywhere_is_noticed(tmp_path):
    whole = write_recording(tmp_path / "a.parquet", record()).read_bytes()
    expected = record()
    damaged = tmp_path / "b.parquet"
    rng = np.random.default_rng(3)
    for place in rng.choice(len(whole), 150, replace=False):
        changed = bytearray(whole)
        changed[place] ^= 0x10
        damaged.write_bytes(bytes(changed))
        try:
            read = read_recording(damaged)
        except (
            FileFormatError,
            RecordingError,
        ):  # the latter where the bench's key itself was hit: a plain Parquet file
            continue
        assert read == expected  # a byte that says nothing, such as a statistic


@pytest.mark.parametrize("keep", [0, 3, 100, 0.5, -1])
def test_truncated_files_are_named(tmp_path, keep):
    path = write_recording(tmp_path / "a.parquet", record())
    whole = path.read_bytes()
    path.write_bytes(whole[: int(keep * len(whole)) if isinstance(keep, float) else keep])
    with pytest.raises(FileFormatError, match=r"no readable Parquet file .* restore it"):
        read_recording(path)


def rewritten(path, change):
    """The file with its table or its metadata changed by another tool."""
    found = pq.read_table(path)
    metadata = dict(found.schema.metadata)
    found = change(found, metadata) or found
    pq.write_table(found.replace_schema_metadata(metadata), path)


def test_values_changed_by_another_tool(tmp_path):
    path = write_recording(tmp_path / "a.parquet", record())
    rewritten(path, lambda found, _: found.set_column(1, "displacement", found["Kraft [kN]"]))
    with pytest.raises(FileFormatError, match="not those it was written with"):
        read_recording(path)


def test_header_changed_by_another_tool(tmp_path):
    path = write_recording(tmp_path / "a.parquet", record())

    def change(_, metadata):
        metadata[b"jointbench"] = metadata[b"jointbench"].replace("Prüfstand".encode(), b"other")

    rewritten(path, change)
    with pytest.raises(FileFormatError, match=r"header of .* is not the one .*checksum"):
        read_recording(path)


def test_column_lost_by_another_tool(tmp_path):
    path = write_recording(tmp_path / "a.parquet", record())
    rewritten(path, lambda found, _: found.drop_columns(["displacement"]))
    with pytest.raises(FileFormatError, match=r"contradicts its own header.*displacement"):
        read_recording(path)


def test_later_version_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("bench.record_files.parquet.FORMAT_VERSION", 2)
    path = write_recording(tmp_path / "a.parquet", record())
    monkeypatch.setattr("bench.record_files.parquet.FORMAT_VERSION", 1)
    with pytest.raises(FileFormatError, match=r"version 2 .* upgrade"):
        read_recording(path)


def test_arguments_that_contradict_the_file(tmp_path):
    path = write_recording(tmp_path / "a.parquet", record())
    for options in (
        {"units": {"displacement": "m"}},
        {"time": "t"},
        {"sample_rate": 5.0},
        {"gaps": "interpolate"},
    ):
        with pytest.raises(RecordingError, match="tells its columns"):
            read_recording(path, **options)


# Foreign formats


def save_csv(path, data, header="time,x,f"):
    np.savetxt(path, data, delimiter=",", header=header, comments="", fmt="%.17g")


def save_hdf5(path, **sets):
    with h5py.File(path, "w") as file:
        for name, values in sets.items():
            file[name] = values


def save_parquet(path, data):
    import pyarrow as pa

    pq.write_table(pa.table({"time": data[:, 0], "x": data[:, 1], "f": data[:, 2]}), path)


SAVED = {
    "a.npz": lambda path, data: np.savez(path, data=data),
    "a.mat": lambda path, data: scipy.io.savemat(path, {"data": data}),
    "a.h5": lambda path, data: save_hdf5(path, data=data),
    "b.hdf5": lambda path, data: save_hdf5(path, data=data),
    "a.csv": save_csv,
    "a.csv.gz": save_csv,
    "a.parquet": save_parquet,
}


@pytest.mark.parametrize("name", SAVED)
def test_formats_give_the_same_recording(tmp_path, name):
    path = tmp_path / name
    data = table()
    SAVED[name](path, data)
    by_name = name.removeprefix("a").removeprefix("b") in (".csv", ".csv.gz", ".parquet")
    columns = {"x": "x", "f": "f"} if by_name else MEASURED.columns
    layout = ColumnMap(
        columns, MEASURED.units, MEASURED.quantities, MEASURED.roles, time="" if by_name else MEASURED.time
    )
    read = read_recording(path, columns=layout, settle=0.1)
    np.testing.assert_array_equal(read.values, data[:, 1:])
    assert read.sample_rate == 100.0
    assert read.settle == 0.1
    assert [(c.name, c.unit, c.quantity, c.role) for c in read.channels] == [
        ("x", "inch", "displacement", "prescribed"),
        ("f", "kip", "force", "measured"),
    ]
    assert read.meta["source"]["file"] == name
    assert len(read.meta["source"]["sha256"]) == 64


def test_one_dimensional_arrays_need_no_map(tmp_path):
    t, x, f = table().T
    units = {"x": "m", "f": "N"}
    np.savez(
        tmp_path / "a.npz",
        t=t,
        x=x,
        f=f[:, None],
        note=np.array("abc"),
        picture=np.zeros((3, 4)),
        short=x[:9],
    )
    scipy.io.savemat(tmp_path / "a.mat", {"t": t, "x": x, "f": f, "note": "abc", "picture": np.zeros((3, 4))})
    save_hdf5(tmp_path / "a.h5", t=t, x=x, f=f, picture=np.zeros((3, 4)))
    for name in ("a.npz", "a.mat", "a.h5"):
        read = read_recording(tmp_path / name, units=units)
        assert set(read.names) == {"x", "f"}
        np.testing.assert_array_equal(read["f"], f)
    read = read_recording(tmp_path / "a.h5", columns={"x": "x"}, units={"x": "m"}, sample_rate=50.0)
    assert read.time[1] == 0.02
    assert read.names == ("x",)


def test_structs_groups_and_units(tmp_path):
    t, x, _ = table().T
    scipy.io.savemat(
        tmp_path / "a.mat", {"run": {"clock": t, "cell": {"force": np.column_stack([x, 2 * x])}}}
    )
    read = read_recording(
        tmp_path / "a.mat", columns={"f": "run.cell.force[:, 1]"}, units={"f": "N"}, time="run.clock"
    )
    np.testing.assert_array_equal(read["f"], 2 * x)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["test_3/clock"] = 1e3 * t
        file["test_3/clock"].attrs["unit"] = "ms"
        file["test_3/force"] = np.stack([x, 2 * x])
        file["test_3/force"].attrs["units"] = np.bytes_(b"kN")
    read = read_recording(tmp_path / "a.h5", columns={"f": "test_3/force[1, :]"}, time="test_3/clock")
    np.testing.assert_array_equal(read["f"], 2 * x)
    assert read.channel("f").unit == "kN"
    assert read.sample_rate == 100.0


CSV_LAYOUTS = {
    "units in headings": "Time [ms],force (kip),x [inch]\n0,1.5,2\n10,2.5,3\n20,3.5,4\n",
    "semicolons, decimal commas": "Time [ms];force [kip];x [inch]\n0,0;1,5;2\n10,0;2,5;3\n20,0;3,5;4\n",
    "tabs": "Time [ms]\tforce [kip]\tx [inch]\n0\t1.5\t2\n10\t2.5\t3\n20\t3.5\t4\n",
    "preamble, spaces, quotes, CRLF": "\r\n".join(
        [
            "# rig 3",
            "# 2024",
            "",
            '"Time [ms]", "force [kip]", "x [inch]"',
            "0, 1.5, 2",
            "10, 2.5, 3",
            "",
            "20, 3.5, 4",
            "",
        ]
    ),
    "heading in the comment": "% rig 3\n% Time [ms],force [kip],x [inch]\n0,1.5,2\n10,2.5,3\n20,3.5,4\n",
    "byte order mark, no last newline": "\ufeffTime [ms],force [kip],x [inch]\n0,1.5,2\n10,2.5,3\n20,3.5,4",
}


@pytest.mark.parametrize("layout", CSV_LAYOUTS)
def test_csv_layouts(tmp_path, layout):
    path = tmp_path / "a.csv"
    path.write_bytes(CSV_LAYOUTS[layout].encode())
    read = read_recording(path)
    np.testing.assert_array_equal(read.time, [0.0, 0.01, 0.02])
    np.testing.assert_array_equal(read["force"], [1.5, 2.5, 3.5])
    np.testing.assert_array_equal(read["x"], [2.0, 3.0, 4.0])
    assert [channel.label for channel in read.channels] == ["force [kip]", "x [inch]"]


def test_csv_without_headings_and_in_the_windows_encoding(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("0,1.5\n0.5,2.5\n")
    read = read_recording(path, columns={"x": "1"}, units={"x": "m"}, time="0")
    np.testing.assert_array_equal(read["x"], [1.5, 2.5])
    path.write_bytes("t,Winkel [°]\n0,1\n1,2\n".encode("latin-1"))
    assert read_recording(path).to_units({"Winkel": "rad"})["Winkel"][0] == pytest.approx(
        np.pi / 180, rel=1e-15
    )


def test_csv_gaps_are_found_and_bridged(tmp_path):
    path = tmp_path / "a.csv"
    lines = ["time,x [m]", *(f"{k / 100:.2f},{k}" for k in range(20) if k not in (7, 8))]
    lines[12] = lines[12].split(",")[0] + ","
    path.write_text("\n".join(lines))
    with pytest.raises(RecordingError, match=r"a.csv': .* 2 samples missing \(2 after t = 0.06 s\)"):
        read_recording(path)
    read = read_recording(path, gaps="interpolate")
    np.testing.assert_allclose(read["x"], np.arange(20), rtol=1e-14)  # PCHIP keeps a straight line
    assert read.meta["repaired"]["missing_samples"] == 2
    assert read.meta["repaired"]["values"] == {"x": 1}


WRONG_CSV = {
    "empty": ("", "holds no table: it is empty"),
    "comments only": ("# a\n\n", "empty but for comments"),
    "headings only": ("time,x\n\n", r"headings \(time, x\) but no line of numbers"),
    "cell": ("time,x [m]\n0,1\n0.1,2\n\n0.2,two\n", "column 'x \\[m\\]' of 'a.csv' .* line 5 holds 'two'"),
    "cell in the time": ("time,x [m]\n0,1\nabc,2\n", "column 'time' .* line 3 holds 'abc'"),
    "ragged": ("time,x [m]\n0,1\n0.1\n0.2,3\n", "2 columns at line 3"),
    "too long": ("time,x [m]\n0,1\n0.1,1,2\n", "2 columns at line 3"),
    "twice": ("time,x,x\n0,1,2\n1,2,3\n", "several columns headed 'x'"),
    "one line": ("time,x [m]\n0,1\n", "single line"),
    "dates of unclear order": (
        "time,x [m]\n01/05/2024 10:00:00,1\n01/05/2024 10:00:01,2\n",
        "line 2 holds '01/05/2024 10:00:00'",
    ),
    "binary": ("a\0b\n", "no text file"),
}


@pytest.mark.parametrize("case", WRONG_CSV)
def test_wrong_csv_is_named(tmp_path, case):
    text, message = WRONG_CSV[case]
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(FileFormatError, match=message):
        read_recording(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("x [m],y [m]\n0,1\n1,2\n", RecordingError, "no column is named 'time' or 't' .*sample_rate="),
        ("time,x\n0,1\n1,2\n", RecordingError, "channel 'x' has no unit"),
        ("time,x [furlongg]\n0,1\n1,2\n", UnitError, "a.csv': channel 'x': unknown unit"),
        ("time [m],x [m]\n0,1\n1,2\n", UnitError, "'m' cannot be converted to 's'"),
        ("time\n0\n1\n", RecordingError, "no column of numbers stands beside"),
        ("time,x [m]\n0,1\n1,\n2,3\n", RecordingError, "channel 'x' is nan at t = 1 s"),
        ("time,x [m]\n0,1\n2,2\n1,3\n", RecordingError, "backwards: from t = 2 s to 1 s at sample 2"),
    ],
)
def test_unusable_csv_is_named(tmp_path, text, error, message):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(error, match=message):
        read_recording(tmp_path / "a.csv")


def test_wrong_sources_are_named(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, data=table(), names=np.array(["a", "b"]), z=np.ones(50) * 1j)
    units = {"x": "m"}
    with pytest.raises(UnknownNameError, match=r"unknown column of 'a.npz' 'date\[:, 1\]'"):
        read_recording(path, columns={"x": "date[:, 1]"}, units=units, sample_rate=1.0)
    for source in ("data[:, 7]", "data[a]", "data[:, 1, 1]"):
        with pytest.raises(FileFormatError, match=r"does not fit 'data' .* shape \(50, 3\)"):
            read_recording(path, columns={"x": source}, units=units, sample_rate=1.0)
    with pytest.raises(FileFormatError, match=r"'data' .* shape \(50, 3\); name one line"):
        read_recording(path, columns={"x": "data"}, units=units, sample_rate=1.0)
    for source in ("names", "z"):
        with pytest.raises(FileFormatError, match="does not hold real numbers"):
            read_recording(path, columns={"x": source}, units=units, sample_rate=1.0)
    with pytest.raises(RecordingError, match=r"'data' \(50, 3\)"):
        read_recording(path, units=units)
    with pytest.raises(RecordingError, match="channel 'x' has shape"):
        read_recording(path, columns={"x": "data[3, :]"}, units=units, time="data[:, 0]")


@pytest.mark.parametrize("name", [name for name in SAVED if name not in ("a.csv", "b.hdf5")])
def test_truncated_and_foreign_contents_are_named(tmp_path, name):
    path = tmp_path / name
    SAVED[name](path, table(2000))
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    options = {"columns": MEASURED} if name in ("a.npz", "a.mat", "a.h5") else {"units": {"x": "m", "f": "N"}}
    with pytest.raises(FileFormatError, match="restore it"):
        read_recording(path, **options)
    for wrong in (b"", b"this is not what the suffix says\n" * 10, gzip.compress(b"abc")[:-4]):
        path.write_bytes(wrong)
        with pytest.raises(FileFormatError, match=r"restore it|is empty"):
            read_recording(path, **options)


def test_special_files_are_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="there is no file"):
        read_recording(tmp_path / "a.parquet")
    (tmp_path / "a.xlsx").write_bytes(b"")
    with pytest.raises(FileFormatError, match=r"suffix '.xlsx'; readable are .parquet, .csv"):
        read_recording(tmp_path / "a.xlsx")
    np.save(tmp_path / "a.npy", np.zeros(3))
    shutil.move(tmp_path / "a.npy", tmp_path / "b.npz")
    with pytest.raises(FileFormatError, match="single array"):
        read_recording(tmp_path / "b.npz")
    np.savez(tmp_path / "c.npz", x=np.array([{}], dtype=object))
    with pytest.raises(FileFormatError, match="Python objects"):
        read_recording(tmp_path / "c.npz")
    # the first 128 bytes of a MATLAB 7.3 file: its text, version 0x0200 and byte order
    (tmp_path / "d.mat").write_bytes(
        b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM" + bytes(512)
    )
    with pytest.raises(FileFormatError, match="no readable HDF5 file"):
        read_recording(tmp_path / "d.mat")


def test_hdf5_without_h5py(tmp_path, monkeypatch):
    save_hdf5(tmp_path / "a.h5", data=table())
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(FileFormatError, match=r"pip install 'jointbench\[io\]'"):
        read_recording(tmp_path / "a.h5", columns=MEASURED)


def test_importing_loads_no_heavy_library():
    code = (
        "import sys, bench.record_files, bench.data\n"
        "print([m for m in ('pyarrow', 'pint', 'scipy', 'h5py', 'numba', 'mujoco') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
