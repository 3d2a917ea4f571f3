"""Figures of each capability of the diagnosis, read from what its command leaves."""

from __future__ import annotations

from typing import Any

from capability_figures import Figures


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


SECONDS = {"sdof": (5, 20), "joint": (20, 60)}
"""Median and 90th percentile of a diagnosis on two idle cores [s], by rig; rigs of one degree of freedom like the first."""


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
        ("foreign effects called unknown, or what they are", share("unknown_caught"), "100 %"),
        (
            "foreign effects called unknown or what they are, or names said not to be all",
            share("unfinished"),
            "",
        ),
        ("two effects: both named", share("both_named"), "≥ 80 %"),
        ("declared indistinguishable sets hold the truth", share("sets_hold_truth"), "≥ 98 %"),
        ("localisation, F1 on regions of the state", number("region_f1"), "≥ 0.9"),
        ("expected calibration error", number("calibration_error"), "≤ 0.05"),
        ("gap after over noise floor, median", number("median_ratio"), "≤ 1.1"),
        ("gap after over noise floor, 90th percentile", number("p90_ratio"), "≤ 1.5"),
        *(
            (
                f"seconds a case, rig {rig}, {what}",
                f"{seconds:.3g}",
                f"≤ {SECONDS.get(rig, SECONDS['sdof'])[i]}",
            )
            for rig, both in told["seconds"].items()
            for i, (what, seconds) in enumerate(zip(("median", "90th percentile"), both, strict=True))
        ),
    ]


def arms(told: Any) -> Figures:
    """Sealed cases of arms, legs and servos of others."""

    def share(key: str) -> str:
        return f"{100.0 * told[key]:.1f} %"

    return [
        ("cases", str(told["n"]), ""),
        ("single effects named exactly, declared sets counted", share("exact"), "≥ 90 %"),
        ("single effects, family right", share("family"), "≥ 95 %"),
        ("joint, body or drive right", share("place"), "≥ 90 %"),
        ("clean cases: false alarms", share("false_alarms"), "≤ 5 %"),
        ("foreign effects called unknown, or what they are", share("unknown_caught"), ""),
        (
            "foreign effects called unknown or what they are, or names said not to be all",
            share("unfinished"),
            "≥ 85 %",
        ),
        ("two effects: both named", share("both_named"), "≥ 70 %"),
        ("discrepancy after over noise floor, median", f"{told['median_ratio']:.3g}", "≤ 1.15"),
        ("the same, 90th percentile", f"{told['p90_ratio']:.3g}", ""),
        ("the same, catalogued effects alone", f"{told['p90_ratio_catalogued']:.3g}", "≤ 1.6"),
        ("seconds a case, median", f"{told['median_seconds']:.3g}", "≤ 60"),
        ("seconds a case, 90th percentile", f"{told['p90_seconds']:.3g}", ""),
    ]


def graded(told: Any) -> Figures:
    """Measured cases, each right, honest or wrong by what was written down before."""
    rows: list[tuple[str, ...]] = []
    for case in told:
        names = " + ".join(f"{name} {p:.2f}" for name, p in case["named"].items())
        sets = "; ".join(" or ".join(one) for one in case["sets"])
        figure = f"{case['grade'] or 'not graded'}: {names or case['verdict']}" + (
            f" (declared: {sets})" if sets else ""
        )
        verdict = "holds" if case["grade"] in {"right", "honest"} else "does not hold"
        rows.append((case["case"], figure, "right or honest", verdict if case["grade"] else ""))
    count = {grade: sum(case["grade"] == grade for case in told) for grade in ("right", "honest", "wrong")}
    rows.append(
        ("wrong", f"{count['wrong']} ({count['right']} right, {count['honest']} honest)", "at most 0")
    )
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


def formats(told: Any) -> Figures:
    """What of a verdict is another where the records come in another format."""
    return [
        (
            f"verdict from {kind}",
            "; ".join(found) or "the same as from CSV",
            "the same as from CSV",
            "does not hold" if found else "holds",
        )
        for kind, found in told["differences"].items()
    ]


def real_formats(told: Any) -> Figures:
    """Real files against their CSV."""
    return [
        (
            row["format"],
            f"{row['channels']} channels of {row['samples']} samples, largest difference {row['apart']:.3g}",
            "the same to the last digit",
            "does not hold" if row["apart"] else "holds",
        )
        for row in told
    ]


BACKGROUND_LIMITS = {
    "main effect named or in a declared set": "≥ 90 %",
    "the same, of effects that leave more than noise does when parameters are re-estimated": "≥ 90 %",
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
    low, high = told["interval"]
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
    told_of = f"{told['within']} within 5 %, {told['explained']} with the whole cause, of {told['n']}"
    held = "holds" if told["within"] + told["explained"] == told["n"] else "does not hold"
    return [*rows, ("all", told_of, "each within 5 % or with its cause", held)]


def ten_minutes(told: Any) -> Figures:
    """From a log to a corrected model."""
    rows = []
    for row in told:
        names = ", ".join(row.get("named", ())) or row.get("verdict", "no verdict")
        figure = f"{row['seconds']:.0f} s, {len(row['steps'])} commands: {names}; {row.get('line', 'no corrected model')}"
        rows.append((row["machine"], figure, "≤ 600 s", "holds" if row["held"] else "**misses**"))
    return rows
