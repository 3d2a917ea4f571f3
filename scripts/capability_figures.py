"""Figures of each capability, read from what its command leaves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Figures = Sequence[tuple[str, ...]]
"""(what, figure, what must hold), and the verdict where it cannot be read off these."""


def demo(told: Any) -> Figures:
    """Both joints of the demonstration."""
    rows = []
    for model in told["joint"]:
        closed = model["force_nmse_percent"]
        figure = "diverges" if closed is None else f"{closed['axial']:.3f} % / {closed['torsional']:.3f} %"
        limits = {
            "published network (30)": "0.2 to 0.5 %",
            "network (30)": "no worse than the published one",
            "network (40)": "≤ 0.10 %",
        }
        rows.append(
            (
                f"deck joint, {model['model']}: force NMSE, closed loop, unseen",
                figure,
                limits.get(model["model"], ""),
            )
        )
        open_loop = model["open_loop_force_nmse_percent"]
        figure = f"{open_loop['axial']:.3f} % / {open_loop['torsional']:.3f} %"
        rows.append((f"deck joint, {model['model']}: force NMSE on the true states", figure, ""))
    for test in told["damper"]:
        for model, value in test["force_nrmse"].items():
            limit = "≤ 0.25" if model == "parametric" else ""
            rows.append(
                (
                    f"real damper, {test['tension_lbf']} lbf, {model}: force NRMSE, unseen",
                    f"{value:.3f}",
                    limit,
                )
            )
    rows.append(
        ("time of the computation", f"{told['seconds']:.0f} s", "≤ 90 s with the installation left out")
    )
    return rows


def benchmark(told: Any) -> Figures:
    """Rows of a group of the benchmark."""
    return [
        (
            f"{row['name']}: {row['meaning']}",
            f"{row['ratio']:.3g} ({row['spread'][0]:.3g} to {row['spread'][1]:.3g})",
            row["limit"],
        )
        for rows in told["groups"].values()
        for row in rows
    ]


def bouc_wen(told: Any) -> Figures:
    """The Bouc-Wen benchmark, by record."""
    values = told["nrmse_percent"]
    return [
        (f"{name.replace('_', ' ')}: NRMSE of the displacement", f"{values[name]:.4f} %", limit)
        for name, limit in (
            ("multisine", "≤ 0.05 %"),
            ("sweep", "≤ 0.05 %"),
            ("sweep_without_decimation_filter", ""),
        )
    ]


def reproduction(told: Any) -> Figures:
    """How many rows of the dissertation hold, and which do not."""
    rows = [(item["identifier"], row) for item in told["items"] for row in item["rows"]]
    figures: list[tuple[str, ...]] = [
        (
            f"{name}: {row['quantity']}" + (f" [{row['unit']}]" if row["unit"] else ""),
            row["ours"]
            + (f"; ten seeds {row['spread']}" if row["spread"] else "")
            + (f" (printed {row['printed']})" if row["printed"] else ""),
            row["tolerance"],
            row["verdict"] + (", chosen" if row["chosen"] else ""),
        )
        for name, row in rows
        if row["holds"] is not None
    ]
    return [*figures, ("time of all items", f"{told['seconds']:.0f} s", "≤ 900 s")]


def monitoring(told: Any) -> Figures:
    """The damper monitor, line by line."""
    figures: list[tuple[str, ...]] = []
    for number, row in enumerate(told["lines"]):
        sought = number < 3  # the kinds that the requirement names: a fifth of C lost
        figures += [
            (f"{row['name']}: false alarms per 1,000 periods", f"{row['rate']:.2f}", "≤ 1"),
            (
                f"{row['name']}: changes found within 10 periods",
                f"{100.0 * row['found']:.1f} %",
                "≥ 100 %" if sought else "",
            ),
        ]
    return figures


def memory_joint(told: Any) -> Figures:
    """The joint with memory beside its rivals."""
    rows = []
    for row in told["rows"]:
        figure = (
            "diverges"
            if row["value"] is None
            else f"{row['value']:.3g} {row['unit'].replace('1', '')}".strip()
        )
        limit = "" if row["limit"] is None else f"{'≥' if row['least'] else '≤'} {row['limit']:.3g}"
        rows.append((f"{row['task']}, {row['model']}: {row['quantity']}", figure, limit))
    return rows


def excitation(told: Any) -> Figures:
    """Methods of excitation beside the best open-loop one."""
    # to certainty in half the time; an identification at least a fifth better, on the SDOF rig a third over all
    rivals, sdof = told["measure"] == "seconds", told["task"] == "sdof"
    figures: list[tuple[str, ...]] = []
    for group, methods in told.items():
        if not isinstance(methods, dict):
            continue
        limit = "≤ 0.5" if rivals else "≤ 0.65" if sdof and group == "all" else "≤ 0.8"
        for name, row in methods.items():
            low, high = row["interval"]
            what = f"{group}, {name}: {told['measure']} [{told['unit']}], interquartile mean"
            figures.append((what, f"{row['middle']:.3g} ({low:.3g} to {high:.3g})", ""))
            if "ratio" in row:
                low, high = row["ratio_interval"]
                what = f"{group}, {name}: of the best baseline's ({row['best_baseline']})"
                figures.append((what, f"{row['ratio']:.3g} ({low:.3g} to {high:.3g})", limit))
            if "ratio" in row:
                what = f"{group}, {name}: steps that violate a limit"
                figures.append((what, f"{row['violations_percent']:.2f} %", "≤ 0.75 %"))
    return figures


def backgrounds(told: Any) -> Figures:
    """Policies beside the best open-loop method, on rigs without and with a background."""
    figures: list[tuple[str, ...]] = []
    for where in ("without background", "with background"):
        for kind, group in told[where].items():
            for name, row in group.items():
                if name.startswith(("policy", "planner", "paced")):
                    low, high = row["ratio_interval"]
                    what = f"rigs {where}, {kind}, {name}: of the best open-loop method's error ({row['best_open_loop']})"
                    figures.append((what, f"{row['ratio']:.3g} ({low:.3g} to {high:.3g})", "≤ 0.8"))
    return figures


def training(told: Any) -> Figures:
    """The training curve, and the policy shipped."""
    curve, shipped = told["curve"], told["shipped"]
    best = max(curve, key=lambda row: row["score"])
    reached = min((row["seconds"] for row in curve if row["score"] >= shipped["score"]), default=None)
    return [
        ("score on held-out rigs, before training", f"{curve[0]['score']:.2f}", ""),
        ("of the best policy", f"{best['score']:.2f}", ""),
        ("of the policy that comes with the bench", f"{shipped['score']:.2f}", ""),
        ("time to that score", "not reached" if reached is None else f"{reached:.0f} s", "≤ 3600 s"),
        ("windows that violate a limit", f"{100 * best['violations']:.2f} %", "≤ 0.75 %"),
    ]


def training_plans(told: Any) -> Figures:
    """What the policy of plans scores, and how long it took."""
    score = told["score"]
    return [
        ("score on held-out rigs (practice benches)", f"{score['score']:.2f}", ""),
        ("time of training", f"{score['seconds']:.0f} s", "≤ 3600 s"),
        ("windows that violate a limit", f"{100 * score['violations']:.2f} %", "≤ 0.75 %"),
    ]


def rewards(told: Any) -> Figures:
    """Rank correlation of rewards with what identification leaves."""
    return [
        (
            f"{name}, {where}",
            f"{row['spearman']:.2f} ({row['interval'][0]:.2f} to {row['interval'][1]:.2f}) of {row['records']} records",
            "≥ 0.8" if name == "expected error" else "",
        )
        for where in ("without background", "with background", "both")
        for name, row in told[where].items()
    ]


def kills(told: Any) -> Figures:
    """Campaigns killed and resumed."""
    figure = f"{told['differ']} of {told['campaigns']} campaigns, {told['kills']} kills"
    return [("campaigns whose bytes differ from those of an undisturbed one", figure, "≤ 0")]
