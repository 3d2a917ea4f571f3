"""Targets: record files of every format, cases over them, models, decks and units."""

from __future__ import annotations

import gzip
import io
import json
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fuzzing.documents import NOMINAL, Target, make_case, read_case, write
from fuzzing.mutations import flipped

N = 400
WORDS = ("nan", "inf", "-", "", "1e999", "1e-", "0x10", "1_000", "abc", "é", "\x00", '"', '"1', ",", ";", "\t", "9" * 400,
         "1,5", "2024-01-01", "12:00:00", "#", "%", "\ufeff", "\r", "-0", "1e308", "99999999999999999999")  # fmt: skip


def table() -> np.ndarray:
    """Time, force and displacement ``(N, 3)``."""
    time = 0.01 * np.arange(N)
    return np.column_stack([time, np.sin(2.0 * time), 0.002 * np.sin(2.0 * time + 0.3)])


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
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for options in (
            {},
            {"units": units, "columns": {name: name for name in units}, "gaps": "interpolate"},
        ):
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


def make_npz(folder: Path) -> None:
    """An archive of arrays."""
    t, f, x = table().T
    np.savez_compressed(folder / "record.npz", time=t, force=f, displacement=x, note=np.array("text"))


def spoil_npz(folder: Path, rng: np.random.Generator) -> None:
    """Change its bytes, or the headers of its arrays."""
    path = folder / "record.npz"
    if rng.random() < 0.5:
        path.write_bytes(flipped(path.read_bytes(), rng))
        return
    shapes = [
        "(400,)",
        "(10**12,)",
        "(1000000000000,)",
        "(-1,)",
        "(2, 200)",
        "()",
        "(0,)",
        "((((((1))))))",
        "[400]",
        "(400, 0, 10**9)",
    ]
    kinds = [
        "'<f8'",
        "'|O'",
        "'<U1000000000'",
        "'<c16'",
        "'<M8[ns]'",
        "'>i2'",
        "[('a', '<f8')]",
        "'V100000'",
        "'|b1'",
        "'zz'",
    ]
    stream = io.BytesIO()
    with zipfile.ZipFile(
        stream, "w", int(rng.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA]))
    ) as archive:
        for name in ("time", "force", "displacement"):
            odd = rng.random() < 0.5
            shape = str(rng.choice(shapes)) if odd else "(400,)"
            kind = str(rng.choice(kinds)) if odd and rng.random() < 0.7 else "'<f8'"
            head = f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
            content = (
                b"\x93NUMPY\x01\x00"
                + len(head).to_bytes(2, "little")
                + head.encode()
                + table()[:, 0].tobytes()
            )
            content = content[: len(content) if rng.random() < 0.8 else int(rng.integers(len(content)))]
            if rng.random() < 0.1:
                content = _zipped(content)
            member = f"{name}.npy" if rng.random() < 0.9 else str(rng.choice(ODD_MEMBERS))
            archive.writestr(member, content)
            if rng.random() < 0.1:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # of two members of one name
                    archive.writestr(member, content)
    path.write_bytes(stream.getvalue())


ODD_MEMBERS = (
    "../time.npy",
    "/etc/passwd.npy",
    "time.npy/",
    "time.NPY",
    ".npy",
    "a" * 300 + ".npy",
    "time.npy.npy",
    "CON.npy",
)


def _zipped(content: bytes) -> bytes:
    """An archive of an archive of an array."""
    for _ in range(2):
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("time.npy", content)
        content = stream.getvalue()
    return content


def make_mat(folder: Path) -> None:
    """A MATLAB file with arrays, a structure and a cell."""
    from scipy.io import savemat

    t, f, x = table().T
    cell = np.array([t[:3], "text", {"a": 1.0}], dtype=object)
    savemat(
        folder / "record.mat",
        {"time": t, "force": f, "displacement": x, "run": {"inner": {"x": x[:5]}}, "cell": cell},
    )


def spoil_mat(folder: Path, rng: np.random.Generator) -> None:
    """Another version or compression, and bytes changed, most often near the tags."""
    from scipy.io import savemat

    path = folder / "record.mat"
    t, f, x = table().T
    kind = int(rng.integers(6))
    if kind == 4:
        from scipy.sparse import random_array

        matrix = random_array((50, 50), density=0.1, rng=rng, format="csc")
        savemat(
            path, {"time": t, "force": f, "displacement": x, "sparse": matrix, "words": np.array(["ab", "c"])}
        )
    elif kind == 5:
        nested: Any = x[:3]
        for _ in range(int(rng.integers(2, 60))):
            nested = (
                {"s": nested, "c": np.array([nested, "x"], dtype=object)}
                if rng.random() < 0.1
                else {"s": nested}
            )
        savemat(
            path, {"time": t, "force": f, "displacement": x, "deep": nested, "flags": np.array([True, False])}
        )
    elif kind == 1:
        savemat(path, {"time": t, "force": f, "displacement": x}, format="4")
    elif kind == 2:
        savemat(path, {"time": t, "force": f, "displacement": x}, do_compression=True)
    content = bytearray(path.read_bytes())
    if rng.random() < 0.6:  # where lengths and shapes stand
        at = int(rng.integers(0 if kind == 1 else 128, min(len(content), 400)))
        content[at : at + 4] = int(rng.choice([0, 1, 2**31 - 1, 2**32 - 1, 10**8, 15, 14, 1 << 16])).to_bytes(
            4, "little"
        )
    path.write_bytes(bytes(content) if rng.random() < 0.5 else flipped(bytes(content), rng))


def make_hdf5(folder: Path) -> None:
    """An HDF5 file with groups, attributes, chunks and compression."""
    import h5py

    t, f, x = table().T
    with h5py.File(folder / "record.h5", "w") as file:
        file["time"] = t
        file["force"] = f
        file.create_dataset("displacement", data=x, chunks=(100,), compression="gzip")
        file["force"].attrs["unit"] = "N"
        file["group/text"] = "a text"


def make_parquet(folder: Path) -> None:
    """A recording in the bench's own file."""
    from bench.record_files import write_recording
    from bench.recording import Recording

    t, f, x = table().T
    write_recording(
        folder / "record.parquet",
        Recording.from_arrays(t, {"force": f, "displacement": x}, units={"force": "N", "displacement": "m"}),
    )


def spoil_parquet(folder: Path, rng: np.random.Generator) -> None:
    """Change its bytes, its header, or the columns beside it."""
    import hashlib

    import pyarrow as pa
    import pyarrow.parquet as pq

    from fuzzing.mutations import mutated

    path = folder / "record.parquet"
    if rng.random() < 0.4:
        path.write_bytes(flipped(path.read_bytes(), rng))
        return
    found = pq.read_table(path)
    metadata = dict(found.schema.metadata)
    text = mutated(json.loads(metadata[b"jointbench"]), rng).encode("utf-8", "replace")
    if rng.random() < 0.7:
        metadata[b"jointbench"] = text
        metadata[b"jointbench_sha256"] = hashlib.sha256(text).hexdigest().encode()
    elif rng.random() < 0.5:
        metadata = {}
        odd = [
            pa.array(["a"] * N),
            pa.array([[1.0]] * N),
            pa.array([None] * N),
            pa.array(np.arange(N)),
            pa.array([b"x"] * N),
        ]
        found = found.set_column(
            int(rng.integers(3)), str(rng.choice(["time", "force", "x"])), odd[int(rng.integers(len(odd)))]
        )
    pq.write_table(found.replace_schema_metadata(metadata), path)


def spoil_bytes(name: str) -> Callable[[Path, np.random.Generator], None]:
    """Changes the bytes of a file."""

    def spoil(folder: Path, rng: np.random.Generator) -> None:
        path = folder / name
        path.write_bytes(flipped(path.read_bytes(), rng))

    return spoil


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


MODEL = """<mujoco model="slide">
  <compiler autolimits="true"/>
  <option timestep="0.002" integrator="RK4"/>
  <include file="assets.xml"/>
  <worldbody>
    <body name="carriage">
      <joint name="x" type="slide" axis="1 0 0" stiffness="400" damping="4"/>
      <geom name="block" type="box" size=".05 .05 .05" mass="2"/>
      <site name="cell"/>
    </body>
  </worldbody>
  <actuator><motor name="shaker" joint="x"/></actuator>
  <sensor><jointpos name="lvdt" joint="x"/></sensor>
</mujoco>
"""
ODD_MJCF = (
    '<include file="model.xml"/>', '<include file="../x.xml"/>', '<include file="assets.xml"/>' * 200, '<include/>',
    '<replicate count="1000000000"><body/></replicate>', '<numeric name="a" size="1000000000"/>', "<worldbody>" * 600,
    '<size memory="1000000G"/>',
    '<size nuserdata="2000000000"/>', '<asset><hfield name="h" nrow="1000000" ncol="1000000" size="1 1 1 1"/></asset>',
    '<asset><mesh name="m" file="/dev/zero"/></asset>', "<!DOCTYPE a [<!ENTITY b 'c'>]>", '<geom size="nan nan nan"/>', "&x;",
    '<custom><numeric name="jointbench:gap" data="1 2 3"/></custom>', '<option timestep="0"/>', '<option timestep="nan"/>',
)  # fmt: skip


def make_mjcf(folder: Path) -> None:
    """A model, and a file that it includes."""
    (folder / "model.xml").write_text(MODEL)
    (folder / "assets.xml").write_text('<mujoco><asset><material name="steel"/></asset></mujoco>')


def spoil_mjcf(folder: Path, rng: np.random.Generator) -> None:
    """Change words and numbers of the model, or put something odd into it."""
    path = folder / ("model.xml" if rng.random() < 0.8 else "assets.xml")
    text = path.read_text()
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(text)))
        if rng.random() < 0.5:
            lines = text.split("\n")
            lines.insert(int(rng.integers(len(lines))), str(rng.choice(ODD_MJCF)))
            text = "\n".join(lines)
        else:
            text = (
                text[:at]
                + str(rng.choice(["", "-", "9" * 30, "nan", '"', "<", "1e308", "x"]))
                + text[at + int(rng.integers(4)) :]
            )
    path.write_text(text)


def read_mjcf(folder: Path) -> None:
    """Build a rig of the user's own and run it for a while."""
    from bench.rig import Rig, simulate
    from bench.signals import Excitation, Harmonic

    rig = Rig.from_file(folder / "model.xml")
    model = rig.model
    if model.nv < 10 and rig.timestep > 1e-4 and "shaker" in rig.built.actuators:
        tone = Harmonic(frequency=3.0, amplitude=1.0)
        simulate(
            rig, Excitation({"shaker": tone}, duration=20.0 * rig.timestep, sample_rate=1.0 / rig.timestep)
        )


def make_deck(folder: Path) -> None:
    """A deck of the published network, in two files."""
    from bench.nastran.network_deck import network_text

    (folder / "deck.bdf").write_text("INCLUDE 'net.bdf'\n")
    (folder / "net.bdf").write_text(network_text(_weights(), components=(1,)))


def _weights() -> Any:
    from bench.laws.network import NetworkWeights

    rng = np.random.default_rng(0)
    return NetworkWeights(
        rng.normal(size=(3, 2)), rng.normal(size=3), rng.normal(size=(1, 3)), rng.normal(size=1)
    )


ODD_CARDS = (
    "SPOINT,1,THRU,99999999", "SPOINT,1,THRU,1", "INCLUDE 'deck.bdf'", "INCLUDE '../deck.bdf'", "INCLUDE ''", "+,1,2", "GRID,1",
    "TABLED1,1", "MPC,1", "DMIG,K,1,0,,1,0,1.+999", "NOLIN1,1,1,1,1.,1,1,1", "SPOINT," + "9" * 5000, "BEGIN BULK", "ENDDATA", "," * 500,
)  # fmt: skip


def spoil_deck(folder: Path, rng: np.random.Generator) -> None:
    """Change fields of the deck, or put odd cards into it."""
    path = folder / str(rng.choice(["deck.bdf", "net.bdf", "net.bdf", "net.bdf"]))
    lines = path.read_text().split("\n")
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(lines)))
        if rng.random() < 0.4:
            lines.insert(at, str(rng.choice(ODD_CARDS)))
        else:
            k = int(rng.integers(max(len(lines[at]), 1)))
            lines[at] = (
                lines[at][:k]
                + str(rng.choice(["", " ", "-", "0", "9", ".", "E", "x", ",", "*", "+"]))
                + lines[at][k + 1 :]
            )
    path.write_bytes(
        flipped("\n".join(lines).encode(), rng) if rng.random() < 0.1 else "\n".join(lines).encode()
    )


def read_deck(folder: Path) -> None:
    """Read a network from a deck."""
    from bench.nastran import read_network

    with np.errstate(all="ignore"):
        read_network(folder / "deck.bdf")


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
