"""Files of named arrays: MATLAB, NumPy and HDF5."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from bench.errors import FileFormatError
from bench.record_files.column_map import Variable


def read_npz(path: Path) -> dict[str, Variable]:
    """The arrays of an npz file.

    Args:
        path: Path of the file.

    Raises:
        FileFormatError: No npz file, truncated, or an array of Python objects.
    """
    try:
        archive = np.load(path, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise FileFormatError(
                f"'{path}' is a single array (npy), not an npz archive; save it with numpy.savez"
            )
        with archive:
            return {name: Variable(archive[name]) for name in archive.files}
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, KeyError) as error:
        if isinstance(error, FileFormatError):
            raise
        if "pickle" in str(error) and zipfile.is_zipfile(path):
            raise FileFormatError(
                f"'{path}' holds Python objects, which are not read for safety; save plain arrays with numpy.savez"
            ) from None
        raise FileFormatError(_unreadable(path, "npz", error)) from None


def read_mat(path: Path) -> dict[str, Variable]:
    """The arrays of a MATLAB file up to version 7.2; a field of a struct is named "struct.field".

    Args:
        path: Path of the file.

    Raises:
        FileFormatError: Version 7.3, no MATLAB file, or truncated.
    """
    from scipy.io import loadmat  # noqa: PLC0415
    from scipy.io.matlab import MatReadError  # noqa: PLC0415

    try:
        contents = loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:  # scipy raises it for version 7.3 and for nothing else
        raise FileFormatError(
            f"'{path}' is a MATLAB file of version 7.3, which is HDF5: save it with '-v7', or give a copy the suffix .h5 and "
            "name the lines of its arrays transposed ('data[2, :]' for MATLAB's data(:, 3))"
        ) from None
    except (
        MatReadError,
        zlib.error,
        ValueError,
        TypeError,
        KeyError,
        EOFError,
        OSError,
        IndexError,
    ) as error:
        raise FileFormatError(_unreadable(path, "MATLAB", error)) from None
    variables: dict[str, Variable] = {}
    for name, value in contents.items():
        if not name.startswith("__"):
            _flatten(name, value, variables)
    return variables


def read_hdf5(path: Path, wanted: Collection[str] | None = None) -> dict[str, Variable]:
    """The data sets of an HDF5 file by path ("test_3/force"), with the unit from an attribute "unit" or "units".

    Args:
        path: Path of the file.
        wanted: Data sets to read; None for all.

    Raises:
        FileFormatError: h5py is not installed, no HDF5 file, or truncated.
    """
    try:
        import h5py  # noqa: PLC0415
    except ImportError:
        raise FileFormatError(f"reading '{path.name}' needs h5py: pip install 'jointbench[io]'") from None

    variables: dict[str, Variable] = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            if wanted is not None and name not in wanted:
                variables[name] = Variable(np.empty(0))
                return
            unit = item.attrs.get("unit", item.attrs.get("units", ""))
            text = unit.decode() if isinstance(unit, bytes) else str(unit)
            variables[name] = Variable(np.asarray(item[()]), text)

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except (OSError, RuntimeError, KeyError) as error:
        raise FileFormatError(_unreadable(path, "HDF5", error)) from None
    return variables


def _flatten(name: str, value: Any, into: dict[str, Variable]) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is None:
        into[name] = Variable(np.asarray(value))
        return
    for part in fields:
        _flatten(f"{name}.{part}", getattr(value, part), into)


def _unreadable(path: Path, kind: str, error: BaseException) -> str:
    why = (str(error).splitlines() or [type(error).__name__])[0] or type(error).__name__
    return (
        f"'{path}' is no readable {kind} file ({why}); it is truncated, damaged, or of another format: restore it from its "
        "source, or give it the suffix of what it is"
    )
