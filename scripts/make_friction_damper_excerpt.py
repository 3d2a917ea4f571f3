"""Makes the shipped excerpt of the friction damper data set from the original records.

    python scripts/make_friction_damper_excerpt.py SOURCE_FOLDER [--output bench/_data/friction_damper]

SOURCE_FOLDER holds the tests of dataset 1 as npz files ("0.5Hz20lbtension.npz", …), each with an array "data" (n, 6): time
[s], displacement [in], friction force [kip], velocity [in/s], actuator forces 1 and 2 [lb], at 1024 Hz. The result is the
same byte for byte wherever it is made, for one version of pyarrow (which writes its own into each file).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from bench.data import FRICTION_DAMPER_FOLDER
from bench.record_files import ColumnMap, read_recording, write_recording
from bench.recording import Recording

FREQUENCIES = (0.5, 1.0)  # [Hz]
TENSIONS = (
    20,
    35,
    70,
    80,
)  # [lbf], the four whose loops are alike in both directions and from cycle to cycle
CYCLES = 6  # two growing, three of full amplitude, one shrinking; the rest of a record adds nothing but bytes

COLUMNS = ColumnMap(
    columns={
        "displacement": "data[:, 1]",
        "force": "data[:, 2]",
        "velocity": "data[:, 3]",
        "tensioner_1": "data[:, 4]",
        "tensioner_2": "data[:, 5]",
    },
    units={
        "displacement": "inch",
        "force": "kip",
        "velocity": "inch/s",
        "tensioner_1": "lbf",
        "tensioner_2": "lbf",
    },
    quantities={
        "displacement": "displacement",
        "force": "force",
        "velocity": "velocity",
        "tensioner_1": "force",
        "tensioner_2": "force",
    },
    roles={
        "displacement": "prescribed",
        "force": "measured",
        "tensioner_1": "measured",
        "tensioner_2": "measured",
    },
    time="data[:, 0]",
)


def excerpt(source: Path, frequency: float, tension: int) -> Recording:
    """The first cycles of a test, with its provenance and what its end at rest tells of offset and noise.

    Args:
        source: Folder of the original records.
        frequency: Frequency of the test [Hz].
        tension: Nominal band tension [lbf].
    """
    original = read_recording(source / f"{frequency:g}Hz{tension}lbtension.npz", columns=COLUMNS)
    rest = original.slice_time(float(original.time[-1]) - 0.5)
    # differences of neighbours, so that a slow creep after the test does not count as noise
    noise = {
        name: _rounded(float(np.std(np.diff(rest[name])) / np.sqrt(2.0)))
        for name in ("displacement", "force", "tensioner_1", "tensioner_2")
    }
    part = original.slice_time(0.0, CYCLES / frequency)
    return Recording.from_arrays(
        part.time,
        {name: part[name] for name in part.names},
        units=COLUMNS.units,
        quantities=COLUMNS.quantities,
        roles=COLUMNS.roles,
        noise_std=noise,
        settle=1.0 / frequency,
        sample_rate=original.sample_rate,
        meta={
            "dataset": "Dataset-Friction-Damper-with-Backlash, dataset 1",
            "authors": "Coble, D., Huggins, P., Cao, L., Ricles, J., Downey, A. (ARTS-Laboratory), 2022",
            "url": "https://github.com/ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash",
            "license": "CC-BY-SA-4.0",
            "changes": f"first {CYCLES} cycles of {len(original)} samples, converted to Parquet, values unchanged",
            "source": original.meta["source"],
            "frequency_Hz": frequency,
            "band_tension_lbf": tension,
            "force_at_rest_kip": _rounded(float(np.mean(rest["force"]))),
            "displacement_at_rest_inch": _rounded(float(np.mean(rest["displacement"]))),
        },
    )


def _rounded(value: float) -> float:
    # sums over many samples differ between processors in their last digits, which the files must not
    return float(f"{value:.3g}")


def main() -> None:
    """Writes the excerpt and prints the size of each file."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("source", type=Path, help="folder with the original npz files")
    parser.add_argument("--output", type=Path, default=FRICTION_DAMPER_FOLDER, help="folder to write to")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    total = 0
    for frequency in FREQUENCIES:
        for tension in TENSIONS:
            path = args.output / f"{frequency:g}Hz_{tension}lb.parquet"
            write_recording(path, excerpt(args.source, frequency, tension))
            total += path.stat().st_size
            print(f"{path.name:22} {path.stat().st_size / 1e3:7.1f} kB")
    print(f"{'total':22} {total / 1e3:7.1f} kB")


if __name__ == "__main__":
    main()
