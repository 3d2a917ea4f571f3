"""Measured records: those that come with the bench, and public ones from a folder that the user fetched.

`friction_damper`: eight tests of a real banded rotary friction damper with backlash under prescribed sinusoidal motion,
from the ARTS-Laboratory's "Dataset-Friction-Damper-with-Backlash" (CC BY-SA 4.0; see ATTRIBUTION.md beside the files).
Two frequencies at each of four band tensions, so that a model can be identified on some and tried on others.

`emps`, `silverbox`, `bouc_wen_benchmark`: benchmarks of the Workshop on Nonlinear System Identification, which may not be shipped; the
files are those of nonlinearbenchmark.org.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.errors import FileFormatError, UnknownNameError
from bench.limits import MissingFileError
from bench.record_files import read_recording
from bench.record_files.arrays import read_mat
from bench.recording import Recording

FRICTION_DAMPER_FOLDER = Path(__file__).resolve().parent / "_data" / "friction_damper"
"""The excerpt's files, its licence and its attribution."""


@cache
def friction_damper_names() -> tuple[str, ...]:
    """Names of the friction damper's tests, by frequency and band tension: "0.5Hz_20lb", …, "1Hz_80lb"."""
    stems = [file.stem for file in FRICTION_DAMPER_FOLDER.glob("*.parquet")]
    return tuple(
        sorted(stems, key=lambda stem: tuple(float(part.rstrip("Hzlb")) for part in stem.split("_")))
    )


@cache
def friction_damper(name: str) -> Recording:
    """A test of the friction damper, in the units it was measured in.

    Channels: displacement [inch] (prescribed), force [kip], velocity [inch/s], tensioner_1 [lbf], tensioner_2 [lbf], at
    1024 Hz; six cycles of which the first two grow to full amplitude, the next three hold it and the last is smaller.
    The first cycle is left out of scores (settle): where in its backlash the damper stood at the start is not known. The
    force at rest is not zero (-0.06 to -0.2 kip, larger at higher tension) and is given as ``meta["force_at_rest_kip"]``,
    not removed: whether it is the sensor's offset or a force held by the band is not known either.

    Args:
        name: One of `friction_damper_names`.

    Raises:
        UnknownNameError: There is no such test.

    Example:
        >>> friction_damper("0.5Hz_35lb").to_si().channel("force").unit
        'N'
    """
    if name not in friction_damper_names():
        raise UnknownNameError("friction damper test", name, friction_damper_names())
    return read_recording(FRICTION_DAMPER_FOLDER / f"{name}.parquet")


@dataclass(frozen=True)
class DataSettings:
    """Numbers of `bench.data`."""

    silverbox_rate: float = 1e7 / 2**14
    """Sample rate of the Silverbox [Hz]."""
    bouc_wen_rate: float = 750.0
    bouc_wen_period: int = 8192
    """Sample rate of the Bouc-Wen benchmark [Hz], and samples of a period of its multisines."""


DATA_SETTINGS = DataSettings()


def emps(folder: str | Path, *, pulses: bool = False) -> Recording:
    """The electro-mechanical positioning system: a drive on a prismatic joint in closed loop, 1 kHz (Janot, Gautier, Brunot 2019).

    Channels: force [N] (the motor's command times its published gain), displacement [m], reference [m].

    Args:
        folder: Folder that holds ``DATA_EMPS.mat``, or ``DATA_EMPS_PULSES.mat``.
        pulses: The test with force pulses of .5 s besides.

    Raises:
        MissingFileError: There is no such file.
        FileFormatError: It does not hold what it should.
    """
    path = Path(folder) / ("DATA_EMPS_PULSES.mat" if pulses else "DATA_EMPS.mat")
    table = _mat(path, "qm", "qg", "vir", "gtau", "t")
    arrays = {
        "force": float(table["gtau"].item()) * table["vir"],
        "displacement": table["qm"],
        "reference": table["qg"],
    }
    time = table["t"]
    rate = (len(time) - 1) / float(time[-1] - time[0])
    units = {"force": "N", "displacement": "m", "reference": "m"}
    return Recording.from_arrays(
        None, arrays, units=units, sample_rate=round(rate, 6), meta={"source": path.name}
    )


def silverbox(folder: str | Path) -> Recording:
    """The Silverbox, an electronic Duffing oscillator: input and output [V] at 610.35 Hz (Wigren and Schoukens 2013).

    Args:
        folder: Folder that holds ``SNLS80mV.mat``.

    Raises:
        MissingFileError: There is no such file.
        FileFormatError: It does not hold what it should.
    """
    path = Path(folder) / "SNLS80mV.mat"
    table = _mat(path, "V1", "V2")
    arrays = {"input": table["V1"], "output": table["V2"]}
    return Recording.from_arrays(
        None,
        arrays,
        units={"input": "V", "output": "V"},
        sample_rate=DATA_SETTINGS.silverbox_rate,
        meta={"source": path.name},
    )


def bouc_wen_benchmark(folder: str | Path) -> dict[str, Recording]:
    """The Bouc-Wen benchmark of Noël and Schoukens (2016), force [N] and displacement [m] at 750 Hz: "train", "multisine", "sweep".

    Args:
        folder: Folder that holds ``train.h5`` and the four ``.mat`` files of the tests.

    Raises:
        MissingFileError: A file is not there.
        FileFormatError: It does not hold what it should.
    """
    from bench.record_files.hdf5 import read_hdf5  # noqa: PLC0415  (h5py, for this set only)

    own = Path(folder)
    if not (own / "train.h5").is_file():
        raise MissingFileError(f"no file '{own / 'train.h5'}'; fetch the benchmark into '{own}'")
    wanted = [f"multisine/{name}" for name in "uy"]
    train = read_hdf5(own / "train.h5", wanted.__contains__)
    pairs = {"train": tuple(train[name].values[:, 0] for name in wanted)}
    for test, name in (("multisine", "multisine"), ("sweep", "sinesweep")):
        pairs[test] = tuple(
            _mat(own / f"{kind}val_{name}.mat", f"{kind}val_{name}")[f"{kind}val_{name}"] for kind in "uy"
        )
    return {
        name: Recording.from_arrays(
            None,
            {"force": u, "displacement": y},
            units={"force": "N", "displacement": "m"},
            sample_rate=DATA_SETTINGS.bouc_wen_rate,
        )
        for name, (u, y) in pairs.items()
    }


def _mat(path: Path, *names: str) -> dict[str, NDArray[np.float64]]:
    """Arrays of a MAT-file, flat, by name."""
    if not path.is_file():
        raise MissingFileError(f"no file '{path}'; fetch the data set into '{path.parent}'")
    table = read_mat(path)
    lacking = [name for name in names if name not in table or not table[name].values.size]
    if lacking:
        raise FileFormatError(
            f"'{path}' has no array {', '.join(repr(name) for name in lacking)}; is it the right file?"
        )
    return {name: np.ravel(table[name].values) for name in names}
