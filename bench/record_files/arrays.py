"""Files of named arrays: NumPy and MATLAB, each asked what it claims before it is given memory."""

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
                raise beyond(path, f"{len(members)} arrays", f"{limits.objects}")
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
        raise FileFormatError(unreadable(path, "npz", error)) from None


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
        raise beyond(path, f"an array '{info.filename[:60]}' of {size_text(claimed)}", size_text(8 * left))
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
            f"'{path}' is a MATLAB file of version 7.3, HDF5 within, which arrays are not read from here: save it again with '-v7'"
        ) from None
    # scipy's reader is compiled and raises whatever its state leads to (UnboundLocalError, MemoryError, struct.error, …)
    except Exception as error:
        raise FileFormatError(unreadable(path, "MATLAB", error)) from None
    variables: dict[str, Variable] = {}
    for name, value in contents.items():
        if not name.startswith("__"):
            _flatten(name, value, variables, limits.depth)
    return variables


def _flatten(name: str, value: Any, into: dict[str, Variable], depth: int) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is None or depth == 0:
        array = np.asarray(value)
        into[name] = Variable(array if array.dtype.kind in "biufc" else np.empty(0, dtype="U1"))
        return
    for part in fields:
        _flatten(f"{name}.{part}", getattr(value, part), into, depth - 1)


def beyond(path: Path, what: str, most: str) -> FileFormatError:
    """The refusal of a file that claims more than is read."""
    return FileFormatError(
        f"'{path}' claims {what}, and {most} is the most that is read: if that is no damage, cut the file into parts, or name the "
        "arrays that are wanted"
    )


def unreadable(path: Path, kind: str, error: BaseException) -> str:
    """What is said of a file that its library cannot read."""
    why = (str(error).splitlines() or [type(error).__name__])[0][:200] or type(error).__name__
    return (
        f"'{path}' is no readable {kind} file ({why}); it is truncated, damaged, or of another format: restore it from its "
        "source, or give it the suffix of what it is"
    )
