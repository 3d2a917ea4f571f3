"""The page of a comparison: which view stands where, so that nothing need be clicked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from bench.errors import UnknownNameError
from bench.recording import Recording
from bench.rerun_log.scene import Eye


@dataclass(frozen=True)
class LayoutSettings:
    """Numbers of `bench.rerun_log.layout`."""

    ground: tuple[int, int, int] = (196, 204, 214)
    """Background of the 3-D views: light enough that dark apparatus stands out."""
    cycles_shown: int = 15
    """Cycles of the motion in the window of the time views; more run together on a screen."""
    plots_a_tab: int = 4
    loops_a_sheet: int = 4
    scenes_a_column: int = 3
    height: float = 760.0
    title: float = 60.0
    lane: float = 42.0
    """Heights of a page, a view's title with its time axis, and a lane of the state view [points]; only their ratios count."""


SETTINGS = LayoutSettings()


class Loop(NamedTuple):
    """One loop: what is drawn over what."""

    name: str
    x_label: str
    y_label: str

    @classmethod
    def of(cls, recording: Recording, x: str, y: str) -> Loop:
        """The loop of two channels."""
        return cls(f"{y} over {x}", label_of(recording, x), label_of(recording, y))


class LogPage(NamedTuple):
    """What is to be laid out."""

    rigs: Mapping[str, str]  # entity -> name
    loops: tuple[Loop, ...]
    groups: Mapping[str, tuple[str, ...]]  # tab -> labels of channels
    errors: tuple[str, ...]  # labels of channels
    lanes: int  # of the bands
    window: float  # [s]
    eye: Eye | None = None

    @classmethod
    def of(
        cls,
        records: Mapping[str, Recording],
        rigs: Mapping[str, str],
        loops: Sequence[tuple[str, str]],
        *,
        lanes: int,
    ) -> LogPage:
        """The page for records, the first of which is the reference."""
        groups: dict[str, list[str]] = {}
        for recording in records.values():
            for channel in recording.channels:
                tab = _tab(channel.name, channel.role)
                label = label_of(recording, channel.name)
                if label not in groups.setdefault(tab, []):
                    groups[tab].append(label)
        forces = dict.fromkeys(y for _, y in loops)
        motions = _distinct(records, dict.fromkeys(x for x, _ in loops if "velocity" not in x))
        key = [label_of(holder_of(records, name), name) for name in (*forces, *motions)]
        groups = {"Joint": key, **groups} if key else groups
        paced = next(iter(motions), next(iter(records.values())).names[0])
        return cls(
            rigs,
            tuple(Loop.of(holder_of(records, x, y), x, y) for x, y in loops),
            {tab: tuple(labels) for tab, labels in groups.items()},
            tuple(key) if len(records) > 1 else (),
            lanes,
            _window(holder_of(records, paced), paced),
        )


def _distinct(records: Mapping[str, Recording], channels: Iterable[str]) -> list[str]:
    """The channels without those that repeat another: elements on the same joint share its motion."""
    kept: list[str] = []
    for channel in channels:
        values = holder_of(records, channel)[channel]
        if not any(np.array_equal(values, holder_of(records, other)[other]) for other in kept):
            kept.append(channel)
    return kept


def holder_of(records: Mapping[str, Recording], *channels: str) -> Recording:
    """The first record that holds all these channels.

    Raises:
        UnknownNameError: None does.
    """
    for recording in records.values():
        if set(channels) <= set(recording.names):
            return recording
    known = {name for recording in records.values() for name in recording.names}
    missing = next((channel for channel in channels if channel not in known), " and ".join(channels))
    raise UnknownNameError("channel of the records", missing, known)


def label_of(recording: Recording, channel: str) -> str:
    """Name and unit of a channel: "force [N]"."""
    unit = next(item.unit for item in recording.channels if item.name == channel)
    return f"{channel} [{unit}]"


def _tab(channel: str, role: str) -> str:
    if "/" in channel:
        return channel.rsplit("/", 1)[0]
    return "Commands" if role == "command" else "Sensors"


def _window(reference: Recording, channel: str) -> float:
    """Seconds in which the channel goes through about `cycles_shown` cycles, by its crossings of the mean."""
    y = reference[channel] - np.mean(reference[channel])
    crossings = int(np.count_nonzero(np.diff(np.signbit(y))))
    duration = float(reference.time[-1] - reference.time[0])
    return (
        duration
        if crossings < 2 * SETTINGS.cycles_shown
        else duration * 2.0 * SETTINGS.cycles_shown / crossings
    )


def _around(window: float) -> rrb.archetypes.TimeAxis:
    half = 0.5 * window
    return rrb.TimeAxis(
        view_range=rr.TimeRange(
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-half),
            end=rrb.TimeRangeBoundary.cursor_relative(seconds=half),
        ),
    )


def _plots(
    folder: str, labels: Sequence[str], page: LogPage, *, prefix: str = ""
) -> list[rrb.TimeSeriesView]:
    """One plot a channel; the first carries the legend, since the colours are the same everywhere."""
    return [
        rrb.TimeSeriesView(
            origin=rr.new_entity_path([folder, label]),
            name=prefix + label,
            axis_x=_around(page.window),
            plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=label == labels[0]),
        )
        for label in labels
    ]


def _series(page: LogPage) -> rrb.Tabs:
    tabs: list[rrb.Container | rrb.View] = []
    for tab, labels in page.groups.items():
        for start in range(0, len(labels), SETTINGS.plots_a_tab):
            part = labels[start : start + SETTINGS.plots_a_tab]
            name = (
                tab if len(labels) <= SETTINGS.plots_a_tab else f"{tab} {start // SETTINGS.plots_a_tab + 1}"
            )
            tabs.append(rrb.Vertical(*_plots("channels", part, page), name=name))
    for start in range(0, len(page.errors), SETTINGS.plots_a_tab):
        part = page.errors[start : start + SETTINGS.plots_a_tab]
        tabs.append(rrb.Vertical(*_plots("errors", part, page, prefix="error of "), name="Errors"))
    return rrb.Tabs(*tabs, active_tab=0)


def _loop_view(loop: Loop, window: float) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(
        origin=rr.new_entity_path(["loops", loop.name]),
        name=loop.name,
        titlebar=False,  # the axes say what is drawn, and the bar would take a fifth of the view
        background=(12, 12, 12),
        visual_bounds=rrb.VisualBounds2D(x_range=[-0.22, 1.1], y_range=[-0.2, 1.3]),
        time_ranges=rrb.VisibleTimeRange(
            "time",
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-0.5 * window),
            end=rrb.TimeRangeBoundary.cursor_relative(),
        ),
    )


def _scenes(page: LogPage) -> list[rrb.Container | rrb.View]:
    controls = None
    if page.eye is not None:
        controls = rrb.EyeControls3D(
            position=page.eye.position, look_target=page.eye.target, eye_up=(0.0, 0.0, 1.0)
        )
    return [
        rrb.Spatial3DView(
            origin=rr.new_entity_path(["rig", entity]),
            name=name,
            background=SETTINGS.ground,
            line_grid=False,
            eye_controls=controls,
        )
        for entity, name in page.rigs.items()
    ]


def _loop_sheets(page: LogPage) -> rrb.Container | rrb.View:
    views = [_loop_view(loop, page.window) for loop in page.loops]
    if len(views) <= SETTINGS.loops_a_sheet:
        return rrb.Grid(*views, grid_columns=1 if len(views) <= 2 else 2)
    sheets = [views[i : i + SETTINGS.loops_a_sheet] for i in range(0, len(views), SETTINGS.loops_a_sheet)]
    return rrb.Tabs(
        *(rrb.Grid(*sheet, grid_columns=2, name=f"Loops {i + 1}") for i, sheet in enumerate(sheets)),
        active_tab=0,
    )


def blueprint(page: LogPage) -> rrb.Blueprint:
    """Rigs on the left, channels and bands in the middle, loops and scores on the right; playing, in a loop.

    A rig is long and flat, so a scene takes a third of a column; the scores stand where that leaves room.
    """
    scores = rrb.TextDocumentView(origin="/scores", name="scores")
    scenes = _scenes(page)
    left, right = list(scenes), [_loop_sheets(page)] if page.loops else []
    left_shares, right_shares = [1.0] * len(scenes), [2.0] * len(right)
    if 0 < len(scenes) < SETTINGS.scenes_a_column or not right:
        left.append(scores)
        left_shares.append(float(max(SETTINGS.scenes_a_column - len(scenes), 1)))
    else:
        right.append(scores)
        right_shares.append(1.0)
    middle: list[rrb.Container | rrb.View] = [_series(page)]
    if page.lanes:
        bands = rrb.StateTimelineView(
            origin="/bands", name="contact and slip", time_view=_around(page.window)
        )
        middle.append(bands)
    bands_share = min((SETTINGS.title + SETTINGS.lane * page.lanes) / SETTINGS.height, 0.5)
    columns = [
        rrb.Vertical(*views, row_shares=shares)
        for views, shares in (
            (left, left_shares),
            (middle, [1.0 - bands_share, bands_share][: len(middle)]),
            (right, right_shares),
        )
        if views
    ]
    return rrb.Blueprint(
        rrb.Horizontal(*columns, column_shares=[1.1, 1.3, 1.2][: len(columns)]),
        rrb.TimePanel(state="collapsed", timeline="time", play_state="playing", loop_mode="all"),
        collapse_panels=True,
    )
