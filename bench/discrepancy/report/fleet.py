"""A fleet: the same model on several robots, or one robot at several times; which effect on which, and what grows.

Cases stand in the order in which they were named. Where all judge alike and more than two hold an effect, its first parameter is
held against that order by Kendall's rank correlation: what grows with it, time or mileage, is told with the probability that
chance alone would order it so.

References:
    M. G. Kendall, A new measure of rank correlation, Biometrika 30, 1938.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import kendalltau

from bench.errors import BenchError, ParameterError
from bench.page import Page


@dataclass(frozen=True)
class FleetSettings:
    """Numbers of `bench.discrepancy.report.fleet`."""

    trend: float = 0.05
    """Probability below which an order is told as a trend, the customary level of a two-sided test."""
    fewest: int = 4
    """Cases that a trend needs: of three, the rarest order has a probability of a third by chance."""


SETTINGS = FleetSettings()


class DiagnosisOptions(NamedTuple):
    """Options of every diagnosis, as of `diagnose`."""

    exclude: tuple[str, ...] = ()
    most: int = 3
    anyway: bool = False
    budget: float | None = None


def diagnose_one(folder: str, options: DiagnosisOptions) -> dict[str, Any]:
    """The verdict of a case as a document with its name; an error where it cannot be diagnosed."""
    from bench.discrepancy.diagnosis import diagnose_folder  # noqa: PLC0415  (runs on workers)

    try:
        return {"case": folder, **diagnose_folder(folder, **options._asdict()).verdict.to_json()}
    except (BenchError, np.linalg.LinAlgError, ArithmeticError) as error:
        return {"case": folder, "error": str(error)}


def diagnose_cases(
    folders: Sequence[Path],
    options: DiagnosisOptions,
    *,
    scheduler: str = "",
    progress: Callable[[str], None] = lambda text: None,
) -> list[dict[str, Any]]:
    """Diagnose cases, here one after the other, or on a dask scheduler.

    Args:
        folders: Case folders, which workers of a scheduler see under the same paths.
        options: Of every diagnosis.
        scheduler: Address of a scheduler; empty for none.
        progress: Called with what is being done.

    Raises:
        ParameterError: The extra `scale` is not installed, or no scheduler answers.
    """
    paths = [str(folder.resolve()) for folder in folders]
    if not scheduler:
        out = []
        for k, path in enumerate(paths):
            progress(f"{Path(path).name} ({k + 1} of {len(paths)})")
            out.append(diagnose_one(path, options))
        return _named(out)
    try:
        from distributed import Client  # noqa: PLC0415  (of the extra `scale`)
    except ImportError:
        raise ParameterError("--scheduler needs the extra scale: pip install 'jointbench[scale]'") from None
    try:
        with Client(scheduler, timeout=10) as client:
            progress(f"{len(paths)} cases on {scheduler}")
            return _named(client.gather(client.map(diagnose_one, paths, options=options, pure=False)))  # type: ignore[arg-type]
    except OSError as error:
        raise ParameterError(f"no dask scheduler answers at '{scheduler}' ({error})") from None


def _named(found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Names of folders in the place of their paths, where these tell them apart."""
    names = [Path(entry["case"]).name for entry in found]
    if len(set(names)) < len(names):
        return found
    return [{**entry, "case": name} for entry, name in zip(found, names, strict=True)]


def fleet_rows(found: Sequence[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of a fleet."""
    lines = []
    for entry in found:
        if "error" in entry:
            lines.append([entry["case"], "not diagnosed", entry["error"], "", ""])
            continue
        effects = "; ".join(_effect(e) for e in entry["named"]) or "; ".join(f"near: {e['name']}" for e in entry["nearest"])  # fmt: skip
        gap = entry["gap"]
        whole = "complete" if entry.get("complete") else "not complete"
        lines.append([entry["case"], entry["verdict"], effects, f"{gap['before']:.3g} -> {gap['after']:.3g}", whole])  # fmt: skip
    return ["case", "verdict", "effects", "gap", ""], lines


def _effect(effect: dict[str, Any]) -> str:
    values = ", ".join(f"{n} {p['value']:.4g} ± {p['std']:.2g}" for n, p in effect["parameters"].items())
    place = f" ({effect['where']})" if effect["where"] else ""
    return f"{effect['name']}{place}: {values}"


def matrix(found: Sequence[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """Header and rows: a row for each effect and place, a column for each case, with how much of the gap the effect closes."""
    keys = list(dict.fromkeys((e["name"], e["where"]) for entry in found for e in entry.get("named", ())))
    out = []
    for name, where in keys:
        cells = []
        for entry in found:
            own = [e for e in entry.get("named", ()) if (e["name"], e["where"]) == (name, where)]
            cells.append(f"{100 * own[0]['closed']:.0f} %" if own else "")
        out.append([name, where, *cells])
    return ["effect", "where", *(entry["case"] for entry in found)], out


class Trend(NamedTuple):
    """A parameter over the cases in their order."""

    parameter: str
    values: tuple[float, ...]
    correlation: float
    probability: float


def trends(found: Sequence[dict[str, Any]]) -> list[Trend]:
    """Parameters of effects that rise or fall with the order of the cases."""
    series: dict[str, list[tuple[int, float]]] = {}
    for k, entry in enumerate(found):
        for effect in entry.get("named", ()):
            for name, estimate in effect["parameters"].items():
                label = " ".join(filter(None, (effect["name"], effect["where"], name)))
                series.setdefault(label, []).append((k, float(estimate["value"])))
    out = []
    for label, points in series.items():
        if len(points) < SETTINGS.fewest:
            continue
        order, values = zip(*points, strict=True)
        test: Any = kendalltau(order, values)
        if float(test.pvalue) < SETTINGS.trend:
            out.append(Trend(label, tuple(values), float(test.statistic), float(test.pvalue)))
    return out


def fleet_page(found: Sequence[dict[str, Any]]) -> Page:
    """A page of all cases: the matrix of effects, the verdicts, what grows."""
    named = sum(bool(entry.get("named")) for entry in found)
    page = Page(
        f"{len(found)} cases",
        f"{named} of {len(found)} lack an effect that was named; the order is that in which the cases were named.",
        "jointbench diagnose",
    )
    header, lines = matrix(found)
    section = page.section("Which effect on which case")
    if lines:
        section.table("Part of the gap that an effect closes", header, lines)
    else:
        section.text("No effect was named on any of them.")
    page.section("Verdicts").table("Gap of the judging records, before and after", *fleet_rows(found))
    grows = page.section("What grows with the order")
    told = trends(found)
    if told:
        rises = [
            [t.parameter, "rises" if t.correlation > 0.0 else "falls", " ".join(f"{v:.4g}" for v in t.values),
             f"{t.correlation:.2f}", f"{t.probability:.2g}"]
            for t in told
        ]  # fmt: skip
        grows.table(
            "Kendall's rank correlation with the order of the cases",
            ["parameter", "", "values", "correlation", "probability by chance"],
            rises,
        )
    else:
        grows.text(
            f"Nothing rises or falls with their order ({SETTINGS.fewest} cases with the same effect are needed to tell)."
        )
    return page
