"""Records in binary files, whole and spoilt."""

from __future__ import annotations

import io
import json
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fuzzing.mutations import flipped
from fuzzing.signals import N, table


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
