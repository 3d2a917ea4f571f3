"""One rerun recording that shows rigs side by side: motion, channels, loops, bands and errors, laid out to be read."""

from __future__ import annotations

import os
import sysconfig
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError, RecordingError, UnknownNameError
from bench.files import OutputError, replacing
from bench.recording import Recording, nmse
from bench.rerun_log.bands import Band, changes, element_bands
from bench.rerun_log.kinematics import body_poses, joint_positions
from bench.rerun_log.layout import LogPage, Loop, blueprint, holder_of, label_of
from bench.rerun_log.scene import eye_of, log_scene
from bench.rerun_log.traces import frame_of, log_frame, log_loop, log_series, trace_style
from bench.rig import Rig

APPLICATION = "jointbench"


@dataclass(frozen=True)
class LogComparisonSettings:
    """Numbers of `bench.rerun_log.comparison`."""

    # Other colours than the variants'; told apart with any colour vision (after IBM's design library palette).
    band_colours: Mapping[str, tuple[int, ...]] = field(
        default_factory=lambda: {
            "contact −": (120, 94, 240, 255),
            "free": (60, 60, 60, 255),
            "contact +": (220, 38, 127, 255),
            "stick": (64, 176, 166, 255),
            "slip": (60, 60, 60, 255),
            "within noise": (60, 60, 60, 255),
            "gap": (255, 176, 0, 255),
            "outside": (60, 60, 60, 255),
            "region −": (120, 94, 240, 255),
            "region +": (220, 38, 127, 255),
        }
    )


SETTINGS = LogComparisonSettings()


class _Clock(NamedTuple):
    time: NDArray[np.float64]  # (n,) [s]
    frames: NDArray[np.int64]  # samples shown as frames
    series_rate: float  # [Hz]


def log_comparison(
    path: str | Path | None,
    rigs: Mapping[str, Rig],
    records: Mapping[str, Recording],
    *,
    loops: Sequence[tuple[str, str]] | None = None,
    bands: Sequence[Band] = (),
    poses: Mapping[str, ArrayLike] | None = None,
    camera: str = "",
    frame_rate: float = 30.0,
    series_rate: float = 200.0,
    title: str = "",
) -> Path | None:
    """Log rigs and their records side by side, the first being the reference the others are compared with.

    Shown without a click: each rig moving in 3-D, its element's channels over time with all variants overlaid, the
    loops force over displacement and force over velocity, bands of gap contact and of stick and slip, errors against
    the reference and their NMSE. Every other channel is a tab away.

    Args:
        path: The ``.rrd`` file, written whole or not at all; None opens the viewer.
        rigs: Rigs by variant, as far as there are any; a laboratory record has none.
        records: Records by variant ("true", "network", …), the reference first, on the same clock.
        loops: (x channel, y channel) of the loops; by default those of the elements of the first rig.
        bands: Further bands, after those of the elements of the first rig.
        poses: Joint positions (n, nq) by variant, for rigs whose record does not tell them.
        camera: Camera of the model to look from; its first one where empty.
        frame_rate: Frames of the 3-D motion and of the loops [1/s]; at most 1800 in all.
        series_rate: Most samples a second and channel shown over time; extremes are kept (`traces.extremes`).
        title: Name of the recording.

    Returns:
        The file written, or None where the viewer was opened.

    Raises:
        ParameterError: No records, or a rate that is not positive.
        RecordingError: The records have different clocks, or hold no joint position of their rig.
        UnknownNameError: A rig or pose of a variant without a record, or a loop over a channel that no record holds.
        OutputError: The file cannot be written, or the viewer not be opened.
    """
    poses = dict(poses or {})
    clock = _clock(records, rigs, poses, frame_rate, series_rate)
    first_rig = next((rigs[variant] for variant in records if variant in rigs), None)
    pairs = _loops(records, first_rig) if loops is None else list(loops)
    for pair in pairs:
        holder_of(records, *pair)
    own = [band for element in (first_rig.elements if first_rig else ()) for band in element_bands(element)]
    lanes = _lanes([*own, *bands], records)
    scenes = {key: variant for variant, key in _keys(records).items() if variant in rigs}
    page = LogPage.of(records, scenes, pairs, lanes=len(lanes))
    if first_rig is not None:
        page = page._replace(eye=eye_of(first_rig.scene, camera))

    with replacing(path) if path is not None else nullcontext() as target:
        stream = rr.RecordingStream(APPLICATION)
        try:
            if target is None:
                _open_viewer(stream, blueprint(page))
            else:
                stream.save(target, default_blueprint=blueprint(page))
            stream.send_recording_name(title or " · ".join(records))
            _log_rigs(stream, rigs, records, poses, clock)
            _log_channels(stream, records, clock)
            _log_errors(stream, records, page.errors, clock)
            _log_loops(stream, records, pairs, clock)
            _log_bands(stream, records, lanes, clock)
            scores = rr.TextDocument(_scores(records, clock), media_type="text/markdown")
            stream.log("scores", scores, static=True)
            stream.flush()
        finally:
            stream.disconnect()
    return None if path is None else Path(path)


def _open_viewer(stream: rr.RecordingStream, layout: rrb.Blueprint) -> None:
    """Start rerun's viewer; the one beside this interpreter counts, whether its environment is activated or not."""
    before = os.environ.get("PATH", "")
    os.environ["PATH"] = os.pathsep.join((sysconfig.get_path("scripts"), before))
    try:
        stream.spawn(default_blueprint=layout)
    except RuntimeError as error:
        reason = str(error).partition("\n")[0]
        raise OutputError(
            f"the rerun viewer cannot be opened: {reason} Give a file to save instead"
        ) from error
    finally:
        os.environ["PATH"] = before


def _clock(
    records: Mapping[str, Recording],
    rigs: Mapping[str, Rig],
    poses: Mapping[str, ArrayLike],
    frame_rate: float,
    series_rate: float,
) -> _Clock:
    if not records:
        raise ParameterError("no records came; at least one is expected")
    for rate in (frame_rate, series_rate):
        if not (np.isfinite(rate) and rate > 0.0):
            raise ParameterError(f"a rate of {rate} Hz came; a positive number is expected")
    for variant in (*rigs, *poses):
        if variant not in records:
            raise UnknownNameError("variant with a record", variant, records)
    (first, reference), *others = records.items()
    time = np.asarray(reference.time)
    if len(time) < 2:
        raise RecordingError(f"the record '{first}' has {len(time)} sample(s); at least two are expected")
    for variant, recording in others:
        if len(recording.time) != len(time) or not np.allclose(recording.time, time, rtol=0.0, atol=1e-9):
            raise RecordingError(
                f"the records '{first}' ({len(time)} samples at {reference.sample_rate:g} Hz) and '{variant}' "
                f"({len(recording.time)} at {recording.sample_rate:g} Hz) have different clocks; resample one of them"
            )
    for variant, qpos in poses.items():
        if len(np.asarray(qpos)) != len(time):
            raise RecordingError(
                f"{len(np.asarray(qpos))} poses of '{variant}' came for a record of {len(time)} samples; one each is expected"
            )
    duration = float(time[-1] - time[0])
    count = max(2, min(int(duration * frame_rate) + 1, 1800, len(time)))
    frames = np.unique(np.round(np.linspace(0, len(time) - 1, count)).astype(int))
    return _Clock(time, frames, series_rate)


def _loops(records: Mapping[str, Recording], rig: Rig | None) -> list[tuple[str, str]]:
    """Force over displacement and over velocity, for each coordinate of each element."""
    held = {name: None for recording in records.values() for name in recording.names}
    pairs = []
    for element in rig.elements if rig is not None else ():
        stem = f"{element.name}/force"
        for force in (name for name in held if name == stem or name.startswith(stem + "_")):
            suffix = force.removeprefix(stem)
            pairs += [(f"{element.name}/{motion}{suffix}", force) for motion in ("displacement", "velocity")]
    return [pair for pair in pairs if pair[0] in held]


def _log_rigs(
    stream: rr.RecordingStream,
    rigs: Mapping[str, Rig],
    records: Mapping[str, Recording],
    poses: Mapping[str, ArrayLike],
    clock: _Clock,
) -> None:
    keys = _keys(records)
    for variant, rig in rigs.items():
        qpos = np.asarray(poses[variant]) if variant in poses else joint_positions(rig, records[variant])
        moved = body_poses(rig.scene, qpos[clock.frames])
        log_scene(stream, ["rig", keys[variant]], rig.scene, clock.time[clock.frames], moved)


def _keys(records: Mapping[str, Recording]) -> dict[str, str]:
    """Entity names of the variants; the number keeps rerun, which sorts by name, to their order."""
    return {variant: f"{number}-{variant}" for number, variant in enumerate(records)}


def _log_channels(stream: rr.RecordingStream, records: Mapping[str, Recording], clock: _Clock) -> None:
    keys = _keys(records)
    for number, (variant, recording) in enumerate(records.items()):
        for channel in recording.names:
            log_series(
                stream, ["channels", label_of(recording, channel), keys[variant]], clock.time, recording[channel],
                label=variant, look=trace_style(number), rate=clock.series_rate,
            )  # fmt: skip


def _log_errors(
    stream: rr.RecordingStream, records: Mapping[str, Recording], labels: Sequence[str], clock: _Clock
) -> None:
    (first, reference), *others = records.items()
    keys = _keys(records)
    for channel in (name for name in reference.names if label_of(reference, name) in labels):
        for number, (variant, recording) in enumerate(others, start=1):
            if channel not in recording.names:
                continue
            log_series(
                stream, ["errors", label_of(reference, channel), keys[variant]], clock.time,
                recording[channel] - reference[channel],
                label=f"{variant} − {first}", look=trace_style(number), rate=clock.series_rate,
            )  # fmt: skip


def _compared(reference: Recording, channel: str) -> bool:
    role = next(item.role for item in reference.channels if item.name == channel)
    return role != "command" and float(np.ptp(reference[channel])) > 0.0


def _log_loops(
    stream: rr.RecordingStream,
    records: Mapping[str, Recording],
    pairs: Sequence[tuple[str, str]],
    clock: _Clock,
) -> None:
    keys = _keys(records)
    for x_name, y_name in pairs:
        holders = {k: r for k, r in records.items() if x_name in r.names and y_name in r.names}
        frame = frame_of([r[x_name] for r in holders.values()], [r[y_name] for r in holders.values()])
        loop = Loop.of(holder_of(records, x_name, y_name), x_name, y_name)
        log_frame(stream, ["loops", loop.name], frame, loop.x_label, loop.y_label)
        for number, (variant, recording) in enumerate(records.items()):
            if variant not in holders:
                continue
            log_loop(
                stream, ["loops", loop.name, keys[variant]], clock.time, frame.place(recording[x_name], recording[y_name]),
                look=trace_style(number), layer=number, frames=clock.time[clock.frames],
            )  # fmt: skip


def _lanes(
    bands: Sequence[Band], records: Mapping[str, Recording]
) -> list[tuple[Band, str, NDArray[np.int64]]]:
    """Bands with the variants they are drawn for, and their states there."""
    return [
        (band, variant, states)
        for band in bands
        for variant, recording in records.items()
        if band.drawn_for(variant) and (states := band.of(recording)) is not None
    ]


def _log_bands(
    stream: rr.RecordingStream,
    records: Mapping[str, Recording],
    lanes: Sequence[tuple[Band, str, NDArray[np.int64]]],
    clock: _Clock,
) -> None:
    keys = _keys(records)
    for band, variant, states in lanes:
        entity = rr.new_entity_path(["bands", band.name, keys[variant]])
        stream.log(
            entity,
            rr.StateConfiguration(
                values=list(band.states),
                labels=list(band.states),
                colors=[SETTINGS.band_colours[s] for s in band.states],
            ),
            static=True,
        )
        at = changes(states)
        rr.send_columns(
            entity,
            [rr.TimeColumn("time", duration=clock.time[at])],
            rr.StateChange.columns(state=[band.states[i] for i in states[at]]),
            recording=stream,
        )


def _scores(records: Mapping[str, Recording], clock: _Clock) -> str:
    """NMSE of every compared channel and variant as a markdown table, element channels first."""
    (first, reference), *others = records.items()
    scored = reference.scored
    lines: list[str] = []
    if others:
        lines += [
            "| channel | rms of " + first + " | " + " | ".join(variant for variant, _ in others) + " |",
            "|:--|--:|" + "--:|" * len(others),
        ]
        names = [name for name in reference.names if _compared(reference, name)]
        for name in sorted(names, key=lambda name: "/" not in name):
            y = reference[name][scored]
            if not float(np.ptp(y)) > 0.0:
                continue
            unit = next(item.unit for item in reference.channels if item.name == name)
            cells = [f"{nmse(y, r[name][scored]):.3g} %" if name in r.names else "–" for _, r in others]
            rms = float(np.sqrt(np.mean(np.square(y))))
            lines.append(f"| {name} | {rms:.4g} {unit} | " + " | ".join(cells) + " |")
    duration = clock.time[-1] - clock.time[0]
    if others:
        lines += ["", f"NMSE against “{first}”: 100 Σ(y − ŷ)² / (N var y), settling time left out."]
    lines += [
        "",
        f"{duration:.4g} s at {reference.sample_rate:g} Hz; over time at most {clock.series_rate:g} samples a second "
        f"are shown, extremes kept; motion in {len(clock.frames)} frames. Scores use every sample.",
    ]
    return "\n".join(lines)
