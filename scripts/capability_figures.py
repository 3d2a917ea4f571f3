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


def measured(told: Any) -> Figures:
    """Measured records, diagnosed."""
    figures = [
        (
            f"{row['case']}, {row['record']}: error of the nominal model → with "
            + (" + ".join(row["named"]) or row["verdict"]),
            f"{row['before']:.3g} → {row['after']:.3g} {row['unit']} ({row['seconds']:.0f} s)",
            "" if row["limit"] is None else f"≤ {row['limit']:.3g}",
        )
        for row in told
    ]
    figures += [
        (
            f"{row['case']}: {name} against the published value",
            f"{entry['found']:.4g} against {entry['published']:.4g} ({entry['percent']:+.1f} %)",
            "within 3 %",
        )
        for row in told
        for name, entry in row.get("published", {}).items()
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


def localisation(told: Any) -> Figures:
    """Where planted forces are found."""
    figures = [(f"F1 over (degree of freedom, state cell), mean of {told['cases']}", told["f1"], "≥ 0.9")]
    figures += [(f"F1, {kind}", value, "") for kind, value in told["by_kind"].items()]
    return [(what, f"{value:.3f}", limit) for what, value, limit in figures]


def pendulum(told: Any) -> Figures:
    """Pendulums through large swings."""
    return [
        ("cases, peak swing", f"{told['n']}, {told['degrees']:.0f} degrees", ""),
        ("missing forces named exactly", f"{100.0 * told['exact']:.1f} %", "≥ 95 %"),
        ("clean cases: false alarms", f"{100.0 * told['false_alarms']:.1f} %", "≤ 5 %"),
        ("gap before, median NRMSE", f"{told['before']:.3g}", ""),
        ("gap after over noise floor, median", f"{told['ratio']:.3g}", "≤ 1.1"),
        ("seconds a case, median", f"{told['seconds']:.3g}", "≤ 20 s"),
    ]


def sealed(told: Any) -> Figures:
    """Sealed cases, by class."""

    def share(key: str) -> str:
        return "–" if told[key] is None else f"{100.0 * told[key]:.1f} %"

    def number(key: str) -> str:
        return "–" if told[key] is None else f"{told[key]:.3g}"

    return [
        ("cases", str(told["n"]), ""),
        ("single effects named exactly, declared sets counted", share("exact"), "≥ 95 %"),
        ("single effects named exactly, no set helping", share("strict"), ""),
        ("single effects, family right", share("family"), "≥ 99 %"),
        ("joint rig: axis right", share("place"), "100 %"),
        ("clean cases: false alarms", share("false_alarms"), "≤ 5 %"),
        ("foreign effects called unknown", share("unknown_caught"), "100 %"),
        ("two effects: both named", share("both_named"), "≥ 80 %"),
        ("declared indistinguishable sets hold the truth", share("sets_hold_truth"), "≥ 98 %"),
        ("localisation, F1 on regions of the state", number("region_f1"), "≥ 0.9"),
        ("expected calibration error", number("calibration_error"), "≤ 0.05"),
        ("gap after over noise floor, median", number("median_ratio"), "≤ 1.1"),
        ("gap after over noise floor, 90th percentile", number("p90_ratio"), "≤ 1.5"),
        ("seconds a case, median", number("median_seconds"), "≤ 20 s sdof, ≤ 60 s joint"),
        ("seconds a case, 90th percentile", number("p90_seconds"), ""),
    ]


def excitation(told: Any) -> Figures:
    """Methods of excitation beside the best open-loop one."""
    # to certainty in half the time; an identification at least a fifth better
    limit = "≤ 0.5" if told["measure"] == "seconds" else "≤ 0.8"
    figures: list[tuple[str, ...]] = []
    for group, methods in told.items():
        if not isinstance(methods, dict):
            continue
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


def graded(told: Any) -> Figures:
    """Measured cases, each right, honest or wrong by what was written down before."""
    rows = []
    for case in told:
        names = " + ".join(f"{name} {p:.2f}" for name, p in case["named"].items())
        sets = "; ".join(" or ".join(one) for one in case["sets"])
        figure = f"{case['grade'] or 'not graded'}: {names or case['verdict']}" + (
            f" (declared: {sets})" if sets else ""
        )
        rows.append((case["case"], figure, "right or honest"))
    count = {grade: sum(case["grade"] == grade for case in told) for grade in ("right", "honest", "wrong")}
    rows.append(("all", ", ".join(f"{n} {grade}" for grade, n in count.items()), "0 wrong"))
    return rows


def planted(told: Any) -> Figures:
    """Faults planted into sound records, and what `jointbench check` says of them."""
    rows = [(fault, found, "") for fault, found in told["found"].items()]
    rows.append(("all faults", f"{100.0 * told['found_share']:.1f} % found", "≥ 95 %"))
    doubted, sound = map(int, told["false_alarms"].split("/"))
    rows.append(("sound records doubted", f"{100.0 * doubted / sound:.1f} % of {sound}", "≤ 2 %"))
    rows.append(
        ("seconds a case", f"{told['median_seconds']:.2f}, at most {told['longest_seconds']:.1f}", "< 5")
    )
    return rows


BACKGROUND_LIMITS = {
    "main effect named or in a declared set": "≥ 90 %",
    "and first": "≥ 85 %",
    "not none": "100 %",
    "one other name at most": "≥ 95 %",
    "clean: no certain name that does not pay on the judging record": "≥ 95 %",
    "background: no certain name that does not pay on the judging record": "≥ 95 %",
    "95 % intervals of the main effect's parameters hold the truth": "≥ 85 %",
    "every number is finite": "100 %",
    "no nominal parameter beyond 4 stated sigma unsaid": "100 %",
}


def background(told: Any) -> Figures:
    """Cases whose truth holds a background besides."""
    rows: list[tuple[str, ...]] = [
        (
            what,
            f"{100.0 * share['value']:.1f} % of {share['n']} ({100.0 * share['low']:.0f} to {100.0 * share['high']:.0f})",
            BACKGROUND_LIMITS.get(what, ""),
        )
        for what, share in told["shares"].items()
    ]
    low, high = told["calibration_interval"]
    figure = f"{told['calibration']:.3f} ({low:.3f} to {high:.3f}; {told['scatter']:.3f} if every probability were exact)"
    return [*rows, ("expected calibration error of names", figure, "≤ 0.05")]


def native_effects(told: Any) -> Figures:
    """MJCF's own effects, put in, diagnosed, applied."""
    rows = []
    for row in told["rows"]:
        names = " + ".join(row["named"]) or row["verdict"]
        rows.append((row["effect"], f"{row['word']}: {names}, {100.0 * row['left']:.0f} % left", ""))
    n = sum(told.get(word, 0) for word in ("closed", "explained"))
    return [*rows, ("named, applied and closed, or short with its cause", f"{n} of {told['n']}", "all")]


def applied(told: Any) -> Figures:
    """Verdicts applied in plain MuJoCo."""
    rows = []
    for row in told["rows"]:
        names = " + ".join(row.get("named", ())) or row.get("verdict", "")
        if "error" in row:
            rows.append((row["case"], row["error"], ""))
        elif row["within"]:
            rows.append((row["case"], f"{names}: within 5 %", ""))
        else:
            rows.append(
                (
                    row["case"],
                    f"{names}: {100.0 * row['off']:.0f} % off, {row['cause'] or 'no cause known'}",
                    "",
                )
            )
    told_of = f"{told['within']} within 5 %, {told['explained']} with a cause, of {told['n']}"
    return [*rows, ("all", told_of, "each within 5 % or with its cause")]


def ten_minutes(told: Any) -> Figures:
    """From a log to a corrected model."""
    rows = []
    for row in told:
        names = ", ".join(row.get("named", ())) or row.get("verdict", "no verdict")
        figure = f"{row['seconds']:.0f} s, {len(row['steps'])} commands: {names}; {row.get('line', 'no corrected model')}"
        rows.append((row["machine"], figure, "≤ 600 s", "holds" if row["held"] else "**misses**"))
    return rows


def robots(told: Any) -> Figures:
    """Public records of robots."""
    rows = []
    for row in told:
        names = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in row["named"].items())
        figure = f"{row['before']:.3g} → {row['after']:.3g}, noise {row['floor']:.3g}, {row['seconds']:.0f} s: {names or row['verdict']}"
        rows.append((f"{row['robot']} ({row['known']}): NRMSE of the worst joint", figure, ""))
    return rows


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
