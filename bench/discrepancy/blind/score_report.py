"""The scores of a blind run as people read them: tables on a terminal, in Markdown, and as a page with figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from bench.discrepancy.blind.background_score import BackgroundScore
from bench.discrepancy.blind.proportions import Share
from bench.discrepancy.blind.scoring import BlindScore
from bench.page import Page

REQUIRED = {
    "exact": "≥ 95 %",
    "family": "≥ 99 %",
    "false_alarms": "≤ 5 %",
    "both_named": "≥ 80 %",
    "unknown_caught": "100 %",
    "place": "100 %",
    "sets_hold_truth": "≥ 98 %",
    "calibration_error": "≤ 0.05",
    "median_ratio": "≤ 1.1",
    "p90_ratio": "≤ 1.5",
    "region_f1": "≥ 0.9",
}
"""What must hold, beside the figures."""
BACKGROUND_REQUIRED = {
    "main effect named or in a declared set": "≥ 90 %",
    "and first": "≥ 85 %",
    "not none": "100 %",
    "95 % intervals of the main effect's parameters hold the truth": "≥ 85 %",
}
"""What must hold of cases with a background; 95 % of everything else."""
LABELS = {
    "exact": "single effects named, or in a declared set",
    "strict": "single effects named, no set helping",
    "family": "single effects, family",
    "place": "place of named effects (joint rig)",
    "false_alarms": "false alarms on clean cases",
    "unknown_caught": "foreign effects called unknown, or what they are",
    "unfinished": "foreign effects called unknown or what they are, or names said not to be all",
    "both_named": "both effects of a double named",
    "tellable": "right where the records can tell",
    "unknown_tellable": "foreign effects called unknown, or what they are, where the records can tell",
    "struck_right": "true effect struck: unknown, or one of its family",
    "struck_unknown": "true effect struck: unknown",
    "sets_hold_truth": "declared sets hold the truth",
    "mean_set": "mean size of a declared set",
    "region_f1": "localisation, F1 on regions of the state",
    "calibration_error": "expected calibration error, named effects",
    "verdict_calibration_error": "expected calibration error, verdicts",
    "median_ratio": "gap after / noise floor, median",
    "p90_ratio": "gap after / noise floor, 90th percentile",
    "p90_ratio_catalogued": "the same, catalogued effects alone",
    "median_seconds": "time of a diagnosis, median [s]",
    "p90_seconds": "time of a diagnosis, 90th percentile [s]",
    "failed": "diagnoses that ended in an error",
}


class CaptionedTable(NamedTuple):
    """A table: caption, header and rows of text."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables(score: BlindScore) -> list[CaptionedTable]:
    """The figures, the bands, the calibration and the confusion, empty ones left out."""
    figures = []
    for name, label in LABELS.items():
        share = score.shares.get(name)
        value = getattr(score, name)
        if share is not None and share.n:
            figures.append((label, _percent(share), str(share.n), REQUIRED.get(name, "")))
        elif share is None and not (isinstance(value, float) and math.isnan(value)):
            figures.append((label, f"{value:.3g}", "", REQUIRED.get(name, "")))
    figures += [
        (f"time of a diagnosis, {rig}, median and 90th percentile [s]", f"{median:.3g}, {p90:.3g}", "", "")
        for rig, (median, p90) in score.seconds.items()
        if len(score.seconds) > 1
    ]
    out = [
        CaptionedTable(
            f"Figures over {score.n} cases",
            ("figure", "value (95 % interval)", "cases", "must hold"),
            tuple(figures),
        )
    ]
    out += [
        CaptionedTable(
            f"Right verdicts by {dimension}",
            (dimension, "right (95 % interval)", "cases"),
            tuple((band, _percent(share), str(share.n)) for band, share in bands.items()),
        )
        for dimension, bands in score.bands.items()
    ]
    if score.reliability:
        rows = tuple((f"{stated:.3f}", f"{true:.3f}", str(n)) for stated, true, n in score.reliability)
        out.append(
            CaptionedTable(
                "Stated probability against truth, named effects",
                ("stated, mean", "true", "named effects"),
                rows,
            )
        )
    if score.confusion:
        rows = tuple(
            (
                truth,
                ", ".join(
                    f"{name} {n}" for name, n in sorted(said.items(), key=lambda item: (-item[1], item[0]))
                ),
            )
            for truth, said in score.confusion.items()
        )
        out.append(
            CaptionedTable("What single effects were diagnosed as", ("withheld", "said, and how often"), rows)
        )
    if score.background is not None:
        out += _with_background(score.background)
    if score.wrong:
        out.append(
            CaptionedTable("Cases that are not right", ("case",), tuple((line,) for line in score.wrong))
        )
    return out


def _with_background(score: BackgroundScore) -> list[CaptionedTable]:
    """Figures, calibration and faults of the cases with a background."""
    rows = [
        (what, _percent(share), str(share.n), BACKGROUND_REQUIRED.get(what, "≥ 95 %"))
        for what, share in score.shares.items()
    ]
    low, high = score.interval
    error = f"{score.calibration:.3f} ({low:.3f} to {high:.3f})"
    rows.append(("expected calibration error, named effects", error, "", "≤ 0.05"))
    rows.append(("the same if every probability were exact", f"{score.scatter:.3f}", "", ""))
    out = [
        CaptionedTable(
            "With a background", ("figure", "value (95 % interval)", "cases", "must hold"), tuple(rows)
        )
    ]
    if score.reliability:
        bins = tuple((f"{stated:.3f}", f"{true:.3f}", str(n)) for stated, true, n in score.reliability)
        out.append(
            CaptionedTable(
                "Stated probability against truth, with a background",
                ("stated, mean", "true", "named effects"),
                bins,
            )
        )
    if score.wrong:
        out.append(
            CaptionedTable(
                "Cases with a background that are not right",
                ("case",),
                tuple((line,) for line in score.wrong),
            )
        )
    return out


def _percent(share: Share) -> str:
    return f"{100 * share.value:.1f} % ({100 * share.low:.0f} to {100 * share.high:.0f})"


def markdown(score: BlindScore, *, title: str = "Blind trials", lead: str = "") -> str:
    """The tables as a Markdown document."""
    parts = [f"# {title}", *([lead] if lead else [])]
    for table in tables(score):
        lines = [_row(table.header), _row(["---"] * len(table.header)), *(_row(row) for row in table.rows)]
        parts += [f"## {table.caption}", "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def score_page(score: BlindScore, *, title: str = "Blind trials", lead: str = "") -> Page:
    """The tables as a self-contained page, with the bands drawn."""
    from bench.figures import bar_table  # noqa: PLC0415  (matplotlib, for pages only)

    out = Page(title, lead)
    for table in tables(score):
        section = out.section(table.caption)
        section.table("", table.header, table.rows)
        dimension = table.header[0]
        if score.bands.get(dimension):
            bars = {band: 100.0 * share.value for band, share in score.bands[dimension].items()}
            figure = bar_table({"right": bars}, axis="right verdicts [%]", log=False)
            section.figure(figure, f"Right verdicts by {dimension}.")
    return out
