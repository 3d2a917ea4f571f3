"""The shipped records, and the script that makes them."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from bench.data import (
    FRICTION_DAMPER_FOLDER,
    bouc_wen_benchmark,
    emps,
    friction_damper,
    friction_damper_names,
    silverbox,
)
from bench.errors import FileFormatError, UnknownNameError
from bench.limits import MissingFileError
from bench.record_files import read_recording


def test_friction_damper_records():
    names = friction_damper_names()
    assert names == tuple(f"{f}Hz_{tension}lb" for f in ("0.5", "1") for tension in (20, 35, 70, 80))
    for name in names:
        recording = friction_damper(name)
        frequency = recording.meta["frequency_Hz"]
        assert name == f"{frequency:g}Hz_{recording.meta['band_tension_lbf']}lb"
        assert [channel.unit for channel in recording.channels] == ["inch", "kip", "inch/s", "lbf", "lbf"]
        assert recording.sample_rate == 1024.0
        assert len(recording) == 6 * 1024 / frequency
        assert recording.settle == 1.0 / frequency
        assert recording.meta["license"] == "CC-BY-SA-4.0"
        steady = recording.slice_time(3.0 / frequency, 4.0 / frequency)
        # a unit inch was commanded; the machine keeps it to a percent
        assert np.ptp(steady["displacement"]) / 2 == pytest.approx(1.0, rel=0.02)
        # the records' own velocity is the slope of the displacement: gains of 1.0001 to 1.0008 were found
        slope, velocity = np.gradient(steady["displacement"], steady.time), steady["velocity"]
        assert np.mean(slope * velocity) / np.mean(velocity**2) == pytest.approx(1.0, abs=5e-3)
        # a damper takes energy: the loop's area is that of a dry-friction loop 4 F a, less the corners that the backlash cuts
        energy = np.trapezoid(steady["force"], steady["displacement"])
        assert 0.75 < energy / (4 * np.median(np.abs(steady["force"]))) < 1.0


def test_friction_damper_force_grows_with_tension():
    rms = [np.std(friction_damper(f"0.5Hz_{tension}lb")["force"]) for tension in (20, 35, 70, 80)]
    assert rms == sorted(rms)
    assert rms[-1] > 2 * rms[0]


def test_unknown_friction_damper_test():
    with pytest.raises(UnknownNameError, match=r"Did you mean '0.5Hz_35lb'"):
        friction_damper("0.5Hz_36lb")


def test_excerpt_ships_with_licence_and_attribution():
    licence = (FRICTION_DAMPER_FOLDER / "LICENSE-CC-BY-SA-4.0.txt").read_text("utf-8")
    assert "Attribution-ShareAlike 4.0 International" in licence
    attribution = (FRICTION_DAMPER_FOLDER / "ATTRIBUTION.md").read_text("utf-8")
    for part in ("ARTS-Laboratory", "Coble", "CC BY-SA 4.0", "What was changed"):
        assert part in attribution
    assert sum(file.stat().st_size for file in FRICTION_DAMPER_FOLDER.iterdir()) < 1.5e6


def test_public_records_are_read_from_a_folder(tmp_path):
    t = np.arange(3000) / 1000.0
    volts = {"vir": 2.0 * np.sin(t), "gtau": 35.0, "qm": np.cos(t), "qg": np.cos(t), "t": t}
    savemat(tmp_path / "DATA_EMPS.mat", volts)
    record = emps(tmp_path)
    assert record.sample_rate == 1000.0
    np.testing.assert_allclose(record["force"], 70.0 * np.sin(t))
    savemat(tmp_path / "SNLS80mV.mat", {"V1": np.sin(t), "V2": np.cos(t)})
    assert silverbox(tmp_path).channel("output").unit == "V"
    for name in ("multisine", "sinesweep"):
        for kind in "uy":
            savemat(tmp_path / f"{kind}val_{name}.mat", {f"{kind}val_{name}": np.sin(t)})
    with pytest.raises(MissingFileError, match=r"train\.h5"):
        bouc_wen_benchmark(tmp_path)
    with pytest.raises(MissingFileError, match="PULSES"):
        emps(tmp_path, pulses=True)
    savemat(tmp_path / "DATA_EMPS.mat", {"qm": t})
    with pytest.raises(FileFormatError, match="'qg', 'vir', 'gtau', 't'"):
        emps(tmp_path)
    (tmp_path / "SNLS80mV.mat").write_bytes(b"nothing")
    with pytest.raises(FileFormatError, match="MATLAB"):
        silverbox(tmp_path)


def test_excerpt_script(tmp_path):
    """The script cuts, describes and writes what it says, on records of the same layout."""
    source = tmp_path / "source"
    source.mkdir()
    t = np.arange(18 * 1024 + 1) / 1024.0
    rng = np.random.default_rng(2)
    for frequency in ("0.5", "1"):
        for tension in (20, 35, 70, 80):
            data = np.column_stack([t, *rng.standard_normal((5, t.size))])
            np.savez(source / f"{frequency}Hz{tension}lbtension.npz", data=data)
    script = Path(__file__).parents[1] / "scripts" / "make_friction_damper_excerpt.py"
    subprocess.run(
        [sys.executable, script, source, "--output", tmp_path / "out"], check=True, capture_output=True
    )
    written = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert written == sorted(f"{name}.parquet" for name in friction_damper_names())
    with np.load(source / "1Hz80lbtension.npz") as archive:
        data = archive["data"]
    made = read_recording(tmp_path / "out" / "1Hz_80lb.parquet")
    np.testing.assert_array_equal(made.values, data[: 6 * 1024, 1:])
    assert made.channels[0].noise_std == pytest.approx(1.0, rel=0.2)  # 512 samples of white noise
