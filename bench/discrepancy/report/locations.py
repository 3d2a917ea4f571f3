"""Where a discrepancy lies, as a section of the report: channels, bands, times, and the states at which a force is missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bench.discrepancy.diagnosis import Diagnosis
from bench.discrepancy.localisation.localise import box
from bench.discrepancy.localisation.state_map import StateMap
from bench.discrepancy.report.interactive import loop, share_plot, state_plot
from bench.discrepancy.report.simulated_records import place_channels
from bench.discrepancy.verdict import Split
from bench.page import Page, Section
from bench.recording import Recording


@dataclass(frozen=True)
class LocationsSettings:
    """Numbers of `bench.discrepancy.report.locations`."""

    worth_showing: float = 0.02
    """Share of the excess below which a channel's own bands and times are not drawn."""


SETTINGS = LocationsSettings()


def location_section(out: Page, diagnosis: Diagnosis, runs: Mapping[str, Recording]) -> None:
    """Add where the residuals gather: by channel, band and time, and over the states of every place."""
    section = out.section("Where the gap lies")
    where, verdict = diagnosis.where, diagnosis.verdict
    rows = []
    for location in verdict.locations:
        band = f"{location.band_hz[0]:.3g} to {location.band_hz[1]:.3g}"
        span = f"{location.time_s[0]:.3g} to {location.time_s[1]:.3g}"
        share = f"{100 * location.share:.1f} %"
        rows.append(
            (location.channel, location.dof, share, band, span, location.kind, f"{location.p_value:.1g}")
        )
    if rows:
        header = ("channel", "degree of freedom", "share", "band [Hz]", "time [s]", "cause in", "p-value")
        section.table("Residuals of the nominal model's free run, parameters re-estimated", header, rows)
    for found in where.contradictions:
        section.text(_contradiction_text(found))
    for found in where.maps:
        _map(section, found, runs, verdict.splits, found.place.name or diagnosis.problem.structure.dofs[0])
        for region in where.acting.get(found.place.name, ()):
            fitted = "As named" if verdict.verdict == "effect" else "As the closure has it"
            actor = f"{fitted}, {region['effect']}" if "effect" in region else "By free runs, what is missing"
            section.text(
                f"{actor} acts at {_limits(region, found.place.position_unit)}: {region['force']:+.3g} "
                f"{found.place.force_unit} on average, {100 * region['share']:.0f} % of its square."
            )
    main = {location.channel for location in verdict.locations if location.share > SETTINGS.worth_showing}
    residual = [s for s in verdict.splits if s.kind in {"band_hz", "time_s"} and s.of in main]
    if residual:
        section.plots(
            [share_plot(part) for part in residual],
            "Excess power of the free run's residuals by frequency and by time; filled parts are significant, false discoveries "
            "held at 5 %.",
        )


def _contradiction_text(found) -> str:
    low, high = found.channels
    if not found.found:
        return (
            f"{low} and {high} agree with each other (power of their contradiction {found.ratio:.2f} times the noise's): "
            "a force is missing rather than a sensor at fault, as far as they can tell."
        )
    blame = f" The nominal model contradicts {found.suspect}." if found.suspect else ""
    return (
        f"{low} and {high} contradict each other whatever force acts (power {found.ratio:.3g} times the noise's over windows of "
        f"{found.window_s:.2g} s, p = {found.p_value:.1g}): a sensor or its clock is at fault.{blame}"
    )


def _map(
    section: Section, found: StateMap, runs: Mapping[str, Recording], splits: Sequence[Split], name: str
) -> None:
    place = found.place
    title = f" ({place.name})" if place.name else ""
    section.text(f"Missing force{title}: {region_words(found)}")
    section.plots(
        [state_plot(found)],
        f"Force that the nominal model lacks along the measured motion{title}, mean of each cell. Marked cells differ from zero "
        "significantly; empty ones were never visited twice.",
    )
    x, v, force = place_channels(place.name)
    section.plots(
        [loop(runs, x, force), loop(runs, v, force)],
        f"The same force on the judging record{title}, beside that of the simulations, all through the same estimator.",
    )
    own = [s for s in splits if s.of == "missing force" and s.dof == name]
    if own:
        section.plots(
            [share_plot(part, units=(place.position_unit, place.force_unit)) for part in own],
            f"Shares of the squared missing force{title}; filled parts are significant.",
        )


def region_words(found: StateMap) -> str:
    """The regions of a map in words."""
    unit = found.place.position_unit
    if not found.regions:
        return "no region of the state space stands out."
    parts = []
    for region in found.regions[:4]:
        parts.append(
            f"{_limits(box(region), unit)}: {region.force:+.3g} {found.place.force_unit} on average, "
            f"{100 * region.share:.0f} % of its square"
        )
    return "; ".join(parts) + "."


def _limits(region: Mapping[str, Any], unit: str) -> str:
    """The limits of a region in words."""
    units = {"displacement": unit, "velocity": f"{unit}/s"}
    limits = [
        f"{name} {region[name][0]:.3g} to {region[name][1]:.3g} {units[name]}"
        for name in units
        if name in region
    ]
    return " and ".join(limits) or "all states"
