"""Regenerate docs/results.md: every capability, the command that shows it, and the figure it gave last.

    python scripts/results.py                 all that the repository can show by itself
    python scripts/results.py demo native     only these
    python scripts/results.py --data FOLDER   also those that need measured records which are not shipped
    python scripts/results.py sealed          those that take hours run where they are named only

Figures of what is not run are kept from last time (docs/results.json).
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from benchmark import machine  # noqa: E402

from bench.files import write_text  # noqa: E402

SEALED_SEED = "20261208"
"""Of the sealed cases that are published: a new one for every set, so that nobody has looked at its cases before."""
Figures = list[tuple[str, ...]]
"""(what, figure, what must hold), and the verdict where it cannot be read off these."""


@dataclass(frozen=True)
class Capability:
    """Something the bench can do, shown by one command."""

    name: str
    title: str
    command: tuple[str, ...]
    figures: Callable[[Any], Figures] = field(repr=False)
    data: str = ""  # folder of measured records that it needs and that is not shipped
    before: tuple[tuple[str, ...], ...] = ()  # commands that make what the command reads
    hours: bool = False  # run only where it is named

    def shown(self) -> str:
        """The commands as a person types them."""
        commands = (*self.before, self.command)
        return " && ".join(" ".join(command) for command in commands).replace("{data}", "FOLDER")


def _demo(told: Any) -> Figures:
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


def _benchmark(told: Any) -> Figures:
    return [
        (
            f"{row['name']}: {row['meaning']}",
            f"{row['ratio']:.3g} ({row['spread'][0]:.3g} to {row['spread'][1]:.3g})",
            row["limit"],
        )
        for rows in told["groups"].values()
        for row in rows
    ]


def _bouc_wen(told: Any) -> Figures:
    values = told["nrmse_percent"]
    return [
        (f"{name.replace('_', ' ')}: NRMSE of the displacement", f"{values[name]:.4f} %", limit)
        for name, limit in (
            ("multisine", "≤ 0.05 %"),
            ("sweep", "≤ 0.05 %"),
            ("sweep_without_decimation_filter", ""),
        )
    ]


def _reproduction(told: Any) -> Figures:
    rows = [(item["identifier"], row) for item in told["items"] for row in item["rows"]]
    figures: Figures = [
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


def _monitoring(told: Any) -> Figures:
    figures: Figures = []
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


def _measured(told: Any) -> Figures:
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


def _memory_joint(told: Any) -> Figures:
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


def _localisation(told: Any) -> Figures:
    figures = [(f"F1 over (degree of freedom, state cell), mean of {told['cases']}", told["f1"], "≥ 0.9")]
    figures += [(f"F1, {kind}", value, "") for kind, value in told["by_kind"].items()]
    return [(what, f"{value:.3f}", limit) for what, value, limit in figures]


def _pendulum(told: Any) -> Figures:
    return [
        ("cases, peak swing", f"{told['n']}, {told['degrees']:.0f} degrees", ""),
        ("missing forces named exactly", f"{100.0 * told['exact']:.1f} %", "≥ 95 %"),
        ("clean cases: false alarms", f"{100.0 * told['false_alarms']:.1f} %", "≤ 5 %"),
        ("gap before, median NRMSE", f"{told['before']:.3g}", ""),
        ("gap after over noise floor, median", f"{told['ratio']:.3g}", "≤ 1.1"),
        ("seconds a case, median", f"{told['seconds']:.3g}", "≤ 20 s"),
    ]


def _sealed(told: Any) -> Figures:
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


def _excitation(told: Any) -> Figures:
    # to certainty in half the time; an identification at least a fifth better
    limit = "≤ 0.5" if told["measure"] == "seconds" else "≤ 0.8"
    figures: Figures = []
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


def _training(told: Any) -> Figures:
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


def _excitation_task(task: str, title: str) -> Capability:
    command = ("python", "scripts/evaluate_excitation.py", task, "--json", "-")
    return Capability(f"excitation_{task}", title, command, _excitation, hours=True)


def _graded(told: Any) -> Figures:
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


def _planted(told: Any) -> Figures:
    """Faults planted into sound records, and what `jointbench check` says of them."""
    rows = [(fault, found, "") for fault, found in told["found"].items()]
    rows.append(("all faults", f"{100.0 * told['found_share']:.1f} % found", "≥ 95 %"))
    doubted, sound = map(int, told["false_alarms"].split("/"))
    rows.append(("sound records doubted", f"{100.0 * doubted / sound:.1f} % of {sound}", "≤ 2 %"))
    rows.append(
        ("seconds a case", f"{told['median_seconds']:.2f}, at most {told['longest_seconds']:.1f}", "< 5")
    )
    return rows


def _benchmark_group(name: str, title: str) -> Capability:
    return Capability(name, title, ("python", "scripts/benchmark.py", name, "--json"), _benchmark)


CAPABILITIES: Sequence[Capability] = (
    Capability("demo", "The main job", ("jointbench", "demo", "--json"), _demo),
    _benchmark_group("native", "Native callbacks"),
    Capability(
        "reproduce",
        "The dissertation ([reproduction.md](reproduction.md) has sources and reasons, [gallery.md](gallery.md) the figures)",
        ("python", "scripts/make_gallery.py", "--fresh", "--json"),
        _reproduction,
    ),
    Capability(
        "monitoring",
        "A damper watched in service",
        ("python", "scripts/monitor_damper.py", "--json"),
        _monitoring,
    ),
    _benchmark_group("stream", "Least squares on line, against padasip"),
    _benchmark_group("accuracy", "Equal error: the joint rig against SciPy's integrators"),
    _benchmark_group("identify", "Identification against torch, scikit-learn and mujoco.sysid"),
    _benchmark_group("envs", "Vector environments against gymnasium's own"),
    Capability(
        "trials",
        "Diagnosis of the development trials, made by integrators of others",
        ("jointbench", "blind", "score", "out/trials", "{data}/../trials/answers", "--json"),
        _sealed,
        before=(("jointbench", "blind", "run", "{data}/../trials", "out/trials", "--again"),),
        data="../trials",
    ),
    Capability(
        "sealed",
        "Diagnosis of own sealed cases ([blind_results.md](blind_results.md) has the bands)",
        ("python", "scripts/sealed_cases.py", "--n", "300", "--struck", "0", "--seed", SEALED_SEED, "--json"),
        lambda told: _sealed(told["score"]),
        hours=True,
    ),
    Capability(
        "localisation",
        "Where the missing force lies",
        ("python", "scripts/localisation.py", "--json"),
        _localisation,
    ),
    Capability(
        "pendulum",
        "Diagnosis of a pendulum that swings far, gravity read off its MJCF",
        ("python", "scripts/pendulum.py", "--json"),
        _pendulum,
    ),
    Capability(
        "measured",
        "Diagnosis of measured records, the effect never named",
        ("python", "scripts/diagnose_measured.py", "--data", "{data}", "--json"),
        _measured,
        data=".",
    ),
    Capability(
        "measured_cases",
        "Measured records, graded by what was written down before",
        ("python", "scripts/measured_cases.py", "--data", "{data}", "--json"),
        _graded,
        data=".",
    ),
    Capability(
        "check",
        "Faults planted into records of a slide, and what `jointbench check` says",
        ("python", "scripts/planted_faults.py", "--faults", "200", "--sound", "100"),
        _planted,
    ),
    Capability(
        "unstated",
        "The same where nothing is said of the acquisition",
        (
            *("python", "scripts/diagnose_measured.py", "--data", "{data}", "bouc_wen", "silverbox"),
            *("--unstated", "--json"),
        ),
        _measured,
        data=".",
    ),
    _benchmark_group("diagnosis", "Diagnosis against mujoco.sysid and pysindy, side by side"),
    Capability(
        "peers",
        "The same on the development trials of one degree of freedom",
        (
            *("python", "scripts/benchmark.py", "diagnosis", "--data", "{data}/../trials"),
            *("--work", "out/peers", "--json"),
        ),
        _benchmark,
        data="../trials",
        hours=True,
    ),
    Capability(
        "peers_joint",
        "The same on the development trials of the joint, mujoco.sysid given ten times the diagnosis's time",
        (
            *("python", "scripts/benchmark.py", "diagnosis", "--data", "{data}/../trials"),
            *("--rig", "joint", "--work", "out/peers_joint", "--json"),
        ),
        _benchmark,
        data="../trials",
        hours=True,
    ),
    _excitation_task(
        "sdof", "Excitation on the SDOF rig: trained policy against the baselines, held-out rigs"
    ),
    _excitation_task("rivals", "Excitation that tells rivals apart: trained policy against the baselines"),
    _benchmark_group("campaign", "Campaigns"),
    *(
        Capability(
            f"training_{task}",
            f"Training from scratch of the policy `{task}`",
            ("python", "scripts/train_excitation.py", task, *options, "--fresh", "--json"),
            _training,
        )
        for task, options in (
            ("sdof", ()),
            ("rivals", ("--steps", "2000000", "--n-envs", "96", "--discount", "0.98")),
        )
    ),
    Capability(
        "memory_joint",
        "The joint with memory against its rivals ([memory-joint.md](memory-joint.md))",
        ("python", "scripts/memory_joint.py", "--data", "{data}", "--fresh", "--json"),
        _memory_joint,
        data="bouc_wen_benchmark",
    ),
    Capability(
        "bouc_wen",
        "Published Bouc-Wen benchmark, its own parameters",
        ("python", "scripts/bouc_wen_benchmark.py", "{data}/bouc_wen_benchmark", "--json"),
        _bouc_wen,
        data="bouc_wen_benchmark",
    ),
)


@dataclass
class Args:
    """Regenerate docs/results.md."""

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Capabilities to run; where none is named, all that can run and take no hours."""
    data: Path | None = None
    """Folder of the measured records that are not shipped."""


def main() -> int:
    """Run what was asked for, keep the rest, write the page."""
    args = tyro.cli(Args, description=__doc__)
    known = {capability.name for capability in CAPABILITIES}
    unknown = sorted(set(args.names) - known)
    if unknown:
        print(f"unknown capability {', '.join(unknown)}; known: {', '.join(sorted(known))}", file=sys.stderr)
        return 2
    store = ROOT / "docs" / "results.json"
    results: dict[str, Any] = json.loads(store.read_text(encoding="utf-8")) if store.exists() else {}
    console = Console(stderr=True)
    failed = False
    for capability in CAPABILITIES:
        wanted = capability.name in args.names or not (args.names or capability.hours)
        if not wanted or (
            capability.data and (args.data is None or not (args.data / capability.data).is_dir())
        ):
            continue
        with console.status(f"running {capability.name}"):
            told = _run(capability, args.data)
        if told is None:
            failed = True
            continue
        results[capability.name] = {
            "figures": capability.figures(told),
            "date": datetime.now(UTC).date().isoformat(),
            "machine": machine(),
        }
    write_text(store, json.dumps(results, indent=1, ensure_ascii=False) + "\n")
    write_text(ROOT / "docs" / "results.md", _page(results))
    return int(failed)


def _run(capability: Capability, data: Path | None) -> Any:
    here = Path(sys.executable).parent
    result: Any = None
    for line in (*capability.before, capability.command):
        command = [part.replace("{data}", str(data)) for part in line]
        command[0] = str(here / command[0])
        result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    try:
        return json.loads(
            result.stdout
        )  # a benchmark whose limit does not hold exits with 1 and still reports
    except json.JSONDecodeError:
        print(f"{capability.name}: {capability.shown()} failed:\n{result.stderr[-2000:]}", file=sys.stderr)
        return None


_NUMBER = re.compile(r"[-−+]?\d[\d  ]*(?:\.\d+)?(?:e[-+]?\d+)?|[-−+]?\.\d+")


def _numbers(text: str) -> list[float]:
    return [
        float(found.replace("−", "-").replace(" ", "").replace(" ", "")) for found in _NUMBER.findall(text)
    ]


def _verdict(what: str, figure: str, limit: str, verdict: str = "") -> str:
    """Whether a figure keeps its limit, **misses** marked; empty where the limit is no number or there is none.

    Of a figure its first number counts, before any bracket, or each of several with a stroke between them.
    """
    if verdict:
        return f"**{verdict}**" if verdict.startswith("does not hold") else verdict
    bound = re.match(r"(≤|≥|at most|at least)\s*([-−\d.]+)", limit)
    whole = re.fullmatch(r"([\d.]+) to ([\d.]+)( %)?", limit)
    apart = re.fullmatch(r"within ([\d.]+) %", limit)
    bracket = re.search(r"\(([-+][\d.]+) %\)", figure)
    if apart and bracket:
        return "holds" if abs(float(bracket[1])) <= float(apart[1]) else "**misses**"
    if limit == "100 %":
        bound = re.match(r"(≥)\s*(\d+)", "≥ 100")
    values = [number for part in figure.partition("(")[0].split("/") for number in _numbers(part)[:1]]
    if "→" in figure:
        values = _numbers(figure.partition("→")[2])[:1]
    if not values or not (bound or whole):
        return ""
    if whole:
        kept = all(float(whole[1]) <= value <= float(whole[2]) for value in values)
    else:
        assert bound is not None
        edge, most = float(bound[2].replace("−", "-")), bound[1] in {"≤", "at most"}
        kept = all(value <= edge if most else value >= edge for value in values)
    return "holds" if kept else "**misses**"


def _page(results: dict[str, Any]) -> str:
    lines = [
        "# Results",
        "Every capability, the command that shows it, and the figure it gave last. `python scripts/results.py` regenerates this page;",
        "with `--data FOLDER` also what needs measured records that may not be shipped. Figures of time depend on the machine; ratios",
        "are medians of interleaved runs, with the 10th and 90th percentile in brackets. What misses its limit is marked.",
        "",
    ]
    for capability in CAPABILITIES:
        entry = results.get(capability.name)
        lines += [f"## {capability.title}", f"`{capability.shown()}`", ""]
        if entry is None:
            lines += ["Not run yet.", ""]
            continue
        lines += ["| what | figure | must hold | verdict |", "|---|---|---|---|"]
        lines += ["| " + " | ".join([*row[:3], _verdict(*row)]) + " |" for row in entry["figures"]]
        lines += [
            "",
            f"{entry['date']}, {entry['machine']['cores']} cores, Python {entry['machine']['python']}.",
            "",
        ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
