"""Foreign logs of one motion, each written by its own library, read alike by the one reader."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bench.cli import main
from bench.discrepancy.intake.logs import log_of
from bench.errors import FileFormatError
from bench.record_files.column_map import ColumnMap
from bench.record_files.columns import read_columns

N, RATE = 400, 100.0
T = np.arange(N) / RATE
Q = 0.3 * np.sin(2.0 * np.pi * 0.7 * T)
V = np.gradient(Q, T)
U = np.where(np.sin(2.0 * np.pi * 0.7 * T) > 0.0, 1.0, -1.0)


def _json(folder):
    rows = [
        {"timestamp": t, "position": q, "goal_position": u, "torque_enable": True}
        for t, q, u in zip(T, Q, U, strict=True)
    ]
    path = folder / "run.json"
    path.write_text(json.dumps({"mass": 1.1, "motor": "servo", "entries": rows}))
    return path, "position", "goal_position"


def _folder(folder):
    path = folder / "sage"
    path.mkdir()
    (path / "joint_list.txt").write_text("Pan\nTilt\n")
    with (path / "state_motor.csv").open("w") as stream:
        stream.write("type,timestamp,positions,velocities\n")
        for t, q, v in zip(T.tolist(), Q.tolist(), V.tolist(), strict=True):
            stream.write(f'STATE,{5.0 + t!r},"[{q!r}, 0.0]","[{v!r}, 0.0]"\n')
    with (path / "control.csv").open("w") as stream:
        stream.write("type,timestamp,positions\n")
        for k in range(0, N, 2):  # at half the rate: held
            stream.write(f'CONTROL,{5.0 + float(T[k])!r},"[{float(U[k])!r}, 0.0]"\n')
    return path, "position_Pan", "command_Pan"


def _lerobot(folder):
    import pyarrow as pa
    import pyarrow.parquet as pq

    (folder / "set" / "meta").mkdir(parents=True)
    (folder / "set" / "data").mkdir()
    names = {"names": ["pan", "tilt"]}
    info = {"features": {"observation.state": names, "action": names}}
    (folder / "set" / "meta" / "info.json").write_text(json.dumps(info))
    path = folder / "set" / "data" / "episode_000000.parquet"
    state, action = ([[float(a), 0.0] for a in x] for x in (Q, U))
    table = {"timestamp": T, "observation.state": state, "action": action, "episode_index": np.zeros(N, int)}
    pq.write_table(pa.table(table), path)
    return path, "observation.state_pan", "action_pan"


def _npz(folder):
    path = folder / "run.npz"
    np.savez(path, time=T, q=Q, u=U)
    return path, "q", "u"


def _mat(folder):
    from scipy.io import savemat

    path = folder / "run.mat"
    savemat(path, {"time": T, "q": Q, "u": U})
    return path, "q", "u"


def _mat73(folder):
    import h5py

    path = folder / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("time", T), ("q", Q), ("u", U)):
            file[name] = values[None, :]
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file")
    return path, "q", "u"


def _hdf5(folder):
    import h5py

    path = folder / "run.h5"
    with h5py.File(path, "w") as file:
        for name, values in (("time", T), ("q", Q), ("u", U)):
            file[name] = values
    return path, "q", "u"


def _lvm(folder):
    path = folder / "run.lvm"
    head = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "***End_of_Header***\t",
        "",
    ]
    head += [
        "Channels\t2\t",
        f"Samples\t{N}\t{N}",
        "Y_Unit_Label\trad\tN",
        "X0\t0\t0",
        f"Delta_X\t{1 / RATE}\t{1 / RATE}",
        "***End_of_Header***\t\t",
    ]
    rows = [f"{t:.9g}\t{q:.12g}\t{u:.12g}" for t, q, u in zip(T, Q, U, strict=True)]
    path.write_text("\n".join([*head, "X_Value\tq\tu\tComment", *rows]) + "\n")
    return path, "q", "u"


def _tdms(folder):
    import nptdms

    path = folder / "run.tdms"
    with nptdms.TdmsWriter(str(path)) as writer:
        clock = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.0}
        channels = [
            nptdms.ChannelObject("run", n, x, {**clock, "unit_string": unit})
            for n, x, unit in (("q", Q, "rad"), ("u", U, "N"))
        ]
        writer.write_segment(channels)
    return path, "q", "u"


def _uff(folder):
    import pyuff

    path = folder / "run.uff"
    for k, (name, x) in enumerate((("q", Q), ("u", U))):
        data = {
            "type": 58, "func_type": 1, "rsp_node": k + 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1, "data": x, "x": T, "id1": name,
            **dict.fromkeys(("orddenom_spec_data_type", "z_axis_spec_data_type"), 0), "binary": 0, "abscissa_inc": 1.0 / RATE, "ver_num": 1,
        }  # fmt: skip
        pyuff.UFF(str(path)).write_sets(data, "add" if k else "overwrite")
    return path, "q", "u"


def _bag(folder, plugin):
    import rosbags.rosbag2 as rosbags
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    known = ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    state, header, time = (types[name] for name in known)
    command = types["std_msgs/msg/Float64"]
    path = folder / f"bag_{plugin}"
    storage = getattr(rosbags.StoragePlugin, plugin)
    with rosbags.Writer(path, version=9, storage_plugin=storage) as writer:
        states = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        commands = writer.add_connection("/pan_command", command.__msgtype__, typestore=store)
        for t, q, v, u in zip(T, Q, V, U, strict=True):
            stamp = 1_700_000_000_000_000_000 + round(t * 1e9)
            head = header(stamp=time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="")
            message = state(
                header=head, name=["pan"], position=np.array([q]), velocity=np.array([v]), effort=np.array([])
            )
            writer.write(commands, stamp, store.serialize_cdr(command(data=float(u)), command.__msgtype__))
            writer.write(states, stamp, store.serialize_cdr(message, state.__msgtype__))
    return path, "position_pan", "pan_command.data"


MAKERS = {
    "json": _json, "folder": _folder, "lerobot": _lerobot, "npz": _npz, "mat": _mat, "mat 7.3": _mat73, "hdf5": _hdf5,
    "lvm": _lvm, "tdms": _tdms, "uff": _uff,
    "rosbag2": lambda folder: _bag(folder, "SQLITE3"), "mcap": lambda folder: _bag(folder, "MCAP"),
}  # fmt: skip


@pytest.mark.parametrize("kind", MAKERS)
def test_formats_hold_the_same_motion(kind, tmp_path):
    path, position, command = MAKERS[kind](tmp_path)
    found = read_columns(path, ColumnMap({}))
    seconds = found.clock.seconds
    assert len(seconds) == N
    # Universal Files keep single-precision digits in their ASCII form, the others a double
    close = 1e-5 if kind == "uff" else 1e-9
    np.testing.assert_allclose(seconds - seconds[0], T, atol=1e-6 if kind in ("rosbag2", "mcap") else close)
    np.testing.assert_allclose(found.arrays[position], Q, atol=close)
    agree = (
        np.mean(found.arrays[command] == U)
        if kind == "folder"
        else np.mean(np.abs(found.arrays[command] - U) < close)
    )
    # in the folder commands come at every second state, so that one in two of the six reversals may be told a sample late
    assert agree >= (1.0 - 6 / N if kind == "folder" else 1.0)
    if kind == "folder":
        assert "held from sample to sample" in " ".join(found.notes)


@pytest.mark.parametrize("told", ["", " [us]"])
def test_tables_of_a_folder_in_microseconds_are_told_so_by_their_headings_or_taken_for_it(told, tmp_path):
    path, position, _ = _folder(tmp_path)
    for name in ("state_motor.csv", "control.csv"):
        heading, *rows = (path / name).read_text().splitlines()
        kind, time, *rest = zip(*(row.split(",", 2) for row in rows), strict=True)
        late = [f"{k},{1e6 * float(t)!r},{x}" for k, t, x in zip(kind, time, *rest, strict=True)]
        (path / name).write_text("\n".join([heading.replace("timestamp", f"timestamp{told}"), *late]))
    log = log_of(path)
    np.testing.assert_allclose(log.time, T, atol=1e-9)
    np.testing.assert_allclose(log.arrays[position], Q, atol=1e-9)
    assert ("taken for us" in " ".join(log.notes)) == (not told)
    (path / "control.csv").write_text(
        (path / "control.csv").read_text().replace("[us]", "").replace("timestamp", "timestamp [ms]")
    )
    with pytest.raises(FileFormatError, match="one unit is expected"):
        log_of(path)


def test_a_bag_without_its_metadata_is_found_in_its_folder(tmp_path):
    path, position, _ = _bag(tmp_path, "SQLITE3")
    (path / "metadata.yaml").unlink()
    np.testing.assert_allclose(log_of(path).arrays[position], Q, atol=1e-9)


def test_an_irregular_clock_is_brought_onto_one_and_told(tmp_path):
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.5, 1.5, N)) / RATE
    log = log_of({"time": time, "q": 0.3 * np.sin(2.0 * np.pi * 0.7 * time)})
    steps = np.diff(log.time)
    assert np.ptp(steps) < 1e-9
    # straight lines between samples at most 15 ms apart miss a sine of 0.7 Hz by (omega h)^2 / 8 of its size
    assert (
        np.abs(log.arrays["q"] - 0.3 * np.sin(2.0 * np.pi * 0.7 * log.time)).max()
        < 0.3 * (4.4 * 0.015) ** 2 / 8.0
    )
    assert "by straight lines" in " ".join(log.notes)


@pytest.mark.parametrize("name", ["a.json", "a.lvm", "a.tdms", "a.uff", "a.mcap", "a.db3"])
def test_what_is_no_log_is_said_so(name, tmp_path, capsys):
    path = tmp_path / name
    path.write_text("no log at all\n")
    with pytest.raises(FileFormatError):
        read_columns(path, ColumnMap({}))
    assert main(["convert", str(path), "-o", str(tmp_path / "out.csv")]) == 2
    assert "Traceback" not in capsys.readouterr().err
