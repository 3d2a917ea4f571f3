"""HDF5 files, read in a process of their own: the library ends the process it runs in on some damaged files.

The reader asks the child for the file; the child names every data set before it reads it, and is told whether it is wanted. What it
has read comes back through a pipe. Where no process can be started the file is read in this one.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Timer
from typing import Any, BinaryIO

import numpy as np

from bench.errors import BenchError, FileFormatError
from bench.limits import READING_LIMITS, ReadingLimits, size_text
from bench.record_files.arrays import beyond, unreadable
from bench.record_files.column_map import Variable

CHILD = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from bench.record_files.hdf5 import serve; serve(sys.argv[2], sys.argv[3])"
)


@dataclass(frozen=True)
class Hdf5Settings:
    """Numbers of `bench.record_files.hdf5`."""

    seconds: float = 15.0
    bytes_a_second: float = 20e6
    """Time that a file may take, and the rate at which the slowest disks and networks in use give more of it: some damaged files have
    no end."""


SETTINGS = Hdf5Settings()


def read_hdf5(
    path: Path, wanted: Callable[[str], bool] | None = None, *, limits: ReadingLimits = READING_LIMITS
) -> dict[str, Variable]:
    """The data sets of an HDF5 file by path ("test_3/force"), with the unit from an attribute "unit" or "units".

    Links to other files are not followed, and data sets whose values lie in other files (external storage, virtual data sets)
    are refused: a record is one file.

    Args:
        path: Path of the file.
        wanted: Which data sets to read; the others are empty in what is returned. None for all.
        limits: What the file may cost.

    Raises:
        FileFormatError: h5py is not installed, no HDF5 file, damaged, values in other files, or beyond the limits.
    """
    try:
        import h5py  # noqa: F401, PLC0415
    except ImportError:
        raise FileFormatError(f"reading '{path.name}' needs h5py: pip install 'jointbench[io]'") from None
    if getattr(sys, "frozen", False):  # an application of its own, no Python that could be started again
        return _read(path, path, wanted, limits)
    command = [
        sys.executable, "-c", CHILD, json.dumps(sys.path), str(path.resolve()), json.dumps([str(path), asdict(limits)])
    ]  # fmt: skip
    try:
        child = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
    except (OSError, ValueError):  # no processes here, or a zero byte in the path
        return _read(path, path, wanted, limits)
    timer = Timer(SETTINGS.seconds + path.stat().st_size / SETTINGS.bytes_a_second, child.kill)
    timer.start()
    try:
        assert child.stdin is not None
        assert child.stdout is not None
        answer = _converse(child.stdin, child.stdout, wanted or (lambda name: True))
    except (OSError, ValueError):  # it ended in the middle of a line or an array
        answer = None
    finally:
        timer.cancel()
        child.kill()
        child.communicate()
    if answer is None:
        raise FileFormatError(
            f"'{path}' is no readable HDF5 file (its library does not survive it); it is damaged: restore it from its source"
        )
    if isinstance(answer, str):
        raise FileFormatError(answer)
    return answer


def _converse(
    to_child: BinaryIO | Any, from_child: BinaryIO | Any, wanted: Callable[[str], bool]
) -> dict[str, Variable] | str | None:
    """The data sets, what is wrong with the file, or None where the child ended without a word."""
    while line := from_child.readline():
        said = json.loads(line)
        if "name" in said:
            to_child.write(b"1\n" if wanted(said["name"]) else b"0\n")
            to_child.flush()
        elif "error" in said:
            return str(said["error"])
        else:
            return {name: _received(from_child, *rest) for name, *rest in said["found"]}
    return None


def _received(stream: BinaryIO | Any, kind: str, shape: list[int], unit: str) -> Variable:
    count = math.prod(shape)
    array = np.empty(count, dtype=kind)
    view = array.view(np.uint8).data
    while view:
        got = stream.readinto(view)
        if not got:
            raise ValueError("the child ended within an array")
        view = view[got:]
    return Variable(array.reshape(shape), unit)


def serve(place: str, what: str) -> None:
    """Read a file for the process that started this one, and answer it on the standard output.

    Args:
        place: Path of the file.
        what: JSON of the path as it is to be called in messages, and of the limits.
    """
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # whatever the library prints is no answer
    called, limits = json.loads(what)

    def tell(**said: Any) -> None:
        out.write(json.dumps(said).encode() + b"\n")
        out.flush()

    def wanted(name: str) -> bool:
        tell(name=name)
        return sys.stdin.readline() == "1\n"

    try:
        found = _read(Path(place), Path(called), wanted, ReadingLimits(**limits))
    except BenchError as error:
        tell(error=str(error))
        return
    arrays = {
        name: np.asarray(v.values, v.values.dtype.newbyteorder("<"), order="C") for name, v in found.items()
    }
    tell(found=[(name, a.dtype.str, a.shape, found[name].unit) for name, a in arrays.items()])
    for array in arrays.values():
        if array.size:
            out.write(array.reshape(-1).view(np.uint8).data)
    out.flush()


def _read(
    path: Path, called: Path, wanted: Callable[[str], bool] | None, limits: ReadingLimits
) -> dict[str, Variable]:
    """Read a file in this process."""
    import h5py  # noqa: PLC0415

    try:
        with h5py.File(path, "r") as file:
            return _data_sets(called, file, wanted, limits)
    except BenchError:
        raise
    # h5py turns the library's errors into whatever class fits best (OSError, RuntimeError, KeyError, ValueError, TypeError, …)
    except Exception as error:
        raise FileFormatError(unreadable(called, "HDF5", error)) from None


def _data_sets(
    path: Path, file: Any, wanted: Callable[[str], bool] | None, limits: ReadingLimits
) -> dict[str, Variable]:
    """All data sets of a file by path; of several names of one group, the first found counts."""
    import h5py  # noqa: PLC0415

    variables: dict[str, Variable] = {}
    left, found = limits.numbers, 0
    waiting: list[tuple[str, Any, int]] = [("", file["/"], 0)]
    groups = {h5py.h5o.get_info(file["/"].id).addr}
    while waiting:
        prefix, group, depth = waiting.pop()
        for key in group:
            found += 1
            if found > limits.objects or depth > limits.depth:
                raise FileFormatError(
                    f"'{path}' holds more than {limits.objects} groups and data sets, or nests them more than {limits.depth} deep, "
                    "which is not read; copy the channels into a file of their own"
                )
            if not isinstance(group.get(key, getlink=True), h5py.HardLink):
                continue  # to another place in this file, or to another file
            item, name = group[key], prefix + key
            if isinstance(item, h5py.Group):
                address = h5py.h5o.get_info(item.id).addr
                if address not in groups:
                    groups.add(address)
                    waiting.append((name + "/", item, depth + 1))
            elif isinstance(item, h5py.Dataset):
                numeric = item.dtype.kind in "biufc"
                if not numeric or item.shape is None or not (wanted is None or wanted(name)):
                    variables[name] = Variable(np.empty(0, dtype=float if numeric else "U1"))
                    continue
                left -= _checked_size(path, name, item, left)
                variables[name] = Variable(np.asarray(item[()]), _unit(item))
    return variables


def _checked_size(path: Path, name: str, item: Any, left: int) -> int:
    """Numbers in a data set that lies in the file itself and fits what is left."""
    if item.external or item.is_virtual:
        raise FileFormatError(
            f"the data set '{name[:60]}' of '{path}' takes its values from other files "
            f"({'a virtual data set' if item.is_virtual else 'external storage'}), which are not followed; copy the values into "
            "this file"
        )
    size = math.prod(item.shape)
    claimed = size * item.dtype.itemsize
    if claimed > 8 * left:
        raise beyond(path, f"a data set '{name[:60]}' of {size_text(claimed)}", size_text(8 * left))
    chunk = math.prod(item.chunks or ()) * item.dtype.itemsize
    if chunk > 8 * left:  # one chunk is unpacked at a time, whatever the shape of the data set
        raise beyond(path, f"a data set '{name[:60]}' in chunks of {size_text(chunk)}", size_text(8 * left))
    return size


def _unit(item: Any) -> str:
    """The text of an attribute "unit" or "units", where it is a single short one."""
    for key in ("unit", "units"):
        if key not in item.attrs:
            continue
        attribute = item.attrs.get_id(key)
        if (
            math.prod(attribute.shape) == 1
            and attribute.dtype.itemsize <= 1000
            and attribute.dtype.kind in "SUO"
        ):
            value = item.attrs[key]
            value = (
                value.item() if isinstance(value, np.ndarray | np.generic) and np.size(value) == 1 else value
            )
            return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return ""
