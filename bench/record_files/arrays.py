"""Files of named arrays: NumPy, MATLAB and HDF5, each asked what it claims before it is given memory."""

from __future__ import annotations

import math
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench.errors import BenchError, FileFormatError
from bench.limits import READING_LIMITS, ReadingLimits, size_text
from bench.record_files.column_map import Variable
from bench.record_files.mat_claims import check_claims


def read_npz(
    path: Path, wanted: Callable[[str], bool] | None = None, *, limits: ReadingLimits = READING_LIMITS
) -> dict[str, Variable]:
    """The arrays of an npz file.

    Args:
        path: Path of the file.
        wanted: Which arrays to read; the others are empty in what is returned. None for all.
        limits: What the file may cost.

    Raises:
        FileFormatError: No npz file, truncated, an array of Python objects, or beyond the limits.
    """
    try:
        with path.open("rb") as stream:
            single = stream.read(6) == b"\x93NUMPY"
        if single:
            raise FileFormatError(
                f"'{path}' is a single array (npy), not an npz archive; save it with numpy.savez"
            )
        with zipfile.ZipFile(path) as archive:
            members = [info for info in archive.infolist() if info.filename.endswith(".npy")]
            if len(members) > limits.objects:
                raise _beyond(path, f"{len(members)} arrays", f"{limits.objects}")
            variables: dict[str, Variable] = {}
            left = limits.numbers
            for info in members:
                name = info.filename.removesuffix(".npy")
                if wanted is not None and not wanted(name):
                    variables[name] = Variable(np.empty(0))
                    continue
                array = _member(path, archive, info, left)
                left -= array.size
                variables[name] = Variable(array)
            return variables
    except BenchError:
        raise
    # zipfile and numpy raise what their documentation does not list (RuntimeError of an encrypted member, struct.error, …)
    except Exception as error:
        raise FileFormatError(_unreadable(path, "npz", error)) from None


def _member(path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo, left: int) -> Any:
    """One array, once its header is known to claim no more than its member holds."""
    with archive.open(info) as stream:
        version = np.lib.format.read_magic(stream)
        if version not in ((1, 0), (2, 0), (3, 0)):
            raise ValueError(f"array '{info.filename}' has version {version}")
        read_header = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, _, kind = read_header(stream)
    if kind.hasobject:
        raise FileFormatError(
            f"'{path}' holds Python objects, which are not read for safety; save plain arrays with numpy.savez"
        )
    if any(n < 0 for n in shape):
        raise ValueError(f"array '{info.filename}' has shape {shape}")
    claimed = math.prod(shape) * kind.itemsize
    if claimed > 8 * left:
        raise _beyond(path, f"an array '{info.filename[:60]}' of {size_text(claimed)}", size_text(8 * left))
    if claimed > info.file_size:
        raise ValueError(
            f"array '{info.filename[:60]}' claims {size_text(claimed)} and holds {size_text(info.file_size)}"
        )
    with archive.open(info) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def read_mat(path: Path, *, limits: ReadingLimits = READING_LIMITS) -> dict[str, Variable]:
    """The arrays of a MATLAB file up to version 7.2; a field of a struct is named "struct.field".

    Args:
        path: Path of the file.
        limits: What the file may cost.

    Raises:
        FileFormatError: Version 7.3, no MATLAB file, truncated, or beyond the limits.
    """
    from scipy.io import loadmat  # noqa: PLC0415

    try:
        names = check_claims(path, limits)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of variables that come twice, and of what it does not know
            contents = loadmat(path, squeeze_me=True, struct_as_record=False, variable_names=names)
    except BenchError:
        raise
    except NotImplementedError:  # scipy raises it for version 7.3 and for nothing else
        raise FileFormatError(
            f"'{path}' is a MATLAB file of version 7.3, which is HDF5: save it with '-v7', or give a copy the suffix .h5 and "
            "name the lines of its arrays transposed ('data[2, :]' for MATLAB's data(:, 3))"
        ) from None
    # scipy's reader is compiled and raises whatever its state leads to (UnboundLocalError, MemoryError, struct.error, …)
    except Exception as error:
        raise FileFormatError(_unreadable(path, "MATLAB", error)) from None
    variables: dict[str, Variable] = {}
    for name, value in contents.items():
        if not name.startswith("__"):
            _flatten(name, value, variables, limits.depth)
    return variables


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
        FileFormatError: h5py is not installed, no HDF5 file, truncated, values in other files, or beyond the limits.
    """
    try:
        import h5py  # noqa: PLC0415
    except ImportError:
        raise FileFormatError(f"reading '{path.name}' needs h5py: pip install 'jointbench[io]'") from None

    try:
        with h5py.File(path, "r") as file:
            return _data_sets(path, file, wanted, limits)
    except BenchError:
        raise
    # h5py turns the library's errors into whatever class fits best (OSError, RuntimeError, KeyError, ValueError, TypeError, …)
    except Exception as error:
        raise FileFormatError(_unreadable(path, "HDF5", error)) from None


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
        raise _beyond(path, f"a data set '{name[:60]}' of {size_text(claimed)}", size_text(8 * left))
    chunk = math.prod(item.chunks or ()) * item.dtype.itemsize
    if chunk > 8 * left:  # one chunk is unpacked at a time, whatever the shape of the data set
        raise _beyond(path, f"a data set '{name[:60]}' in chunks of {size_text(chunk)}", size_text(8 * left))
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


def _flatten(name: str, value: Any, into: dict[str, Variable], depth: int) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is None or depth == 0:
        array = np.asarray(value)
        into[name] = Variable(array if array.dtype.kind in "biufc" else np.empty(0, dtype="U1"))
        return
    for part in fields:
        _flatten(f"{name}.{part}", getattr(value, part), into, depth - 1)


def _beyond(path: Path, what: str, most: str) -> FileFormatError:
    return FileFormatError(
        f"'{path}' claims {what}, and {most} is the most that is read: if that is no damage, cut the file into parts, or name the "
        "arrays that are wanted"
    )


def _unreadable(path: Path, kind: str, error: BaseException) -> str:
    why = (str(error).splitlines() or [type(error).__name__])[0][:200] or type(error).__name__
    return (
        f"'{path}' is no readable {kind} file ({why}); it is truncated, damaged, or of another format: restore it from its "
        "source, or give it the suffix of what it is"
    )
