"""The report of a diagnosis: the same words and numbers on page and console, drawn whole in a browser."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, browser, shown_whole

from bench.cli.verdict_text import verdict_summary
from bench.discrepancy.report.answers import Files, answers, next_steps
from bench.discrepancy.report.interactive import (
    SETTINGS,
    correlation_plot,
    histories,
    loop,
    matrix_plot,
    ranking_plot,
    share_plot,
    waterfall_plot,
)
from bench.discrepancy.report.opening import opened, with_applied
from bench.discrepancy.report.simulated_records import APPLIED
from bench.discrepancy.settings import DEFAULT
from bench.discrepancy.verdict import (
    Estimate,
    Gap,
    InSimulator,
    Location,
    NamedEffect,
    Ranked,
    Split,
    Verdict,
    by_name,
)
from bench.page import Page
from bench.recording import Recording

GAP = Gap(
    "NRMSE, free run", 0.145, 0.14, 0.00551, 0.0051, 0.997, (0.97, 0.999),
    (("nominal model", 0.145), ("parameters only", 0.14), ("+ coulomb_friction", 0.00551)), "elbow",
)  # fmt: skip
FRICTION = NamedEffect(
    "coulomb_friction", "elbow", 0.998, {"limit": Estimate(0.15012, 0.0021, "N m")},
    equation="torque = -limit sign(velocity)", closed=0.98, closed_ci95=(0.97, 0.99),
)  # fmt: skip
VERDICT = Verdict(
    "effect", (FRICTION,), (Ranked("coulomb_friction", "elbow", 0.998), Ranked("backlash", "elbow", 1e-9)), (),
    (Location("elbow_q", "elbow", 0.9, (1.0, 5.0), (0.0, 8.0)),), GAP, (GAP,),
    {"effect": 0.998, "none": 0.001, "unknown": 0.001}, "Missing from the model: coulomb_friction (elbow).",
    complete=True,
)  # fmt: skip
TOLD = InSimulator("in your simulator (elbow): 0.145 -> 0.0057 (diagnosis: 0.00551)", {})
FILES = Files("--model arm/arm.xml --case arm", "out/verdict.json")


def runs() -> dict[str, Recording]:
    time = np.arange(4000) / 500.0

    def run(error: float) -> Recording:
        angles = {"elbow": (1.0 + error) * np.sin(6.0 * time), "shoulder": (1.0 - error) * np.cos(4.0 * time)}
        return Recording.from_arrays(time, angles, units=dict.fromkeys(angles, "rad"))

    return {"measured": run(0.0), "nominal model": run(0.15), "with what is named": run(0.01)}


def report() -> Page:
    """A report with every kind of figure."""
    shown = with_applied(runs(), TOLD._replace(record={"elbow": 1.02 * runs()["measured"]["elbow"]}))
    page = opened("arm", VERDICT, shown, files=FILES, settings=DEFAULT.judgement, applied=TOLD)
    section = page.section("Figures")
    section.plots([waterfall_plot(GAP), histories(shown, ["elbow", "shoulder"], errors=True)], "discrepancy")
    section.plots([loop(shown, "elbow", "shoulder"), loop(shown, "shoulder", "elbow")], "loops")
    section.table("a wide table", ["viscous_damping"] * 12, [["12345.678 ± 0.001"] * 12] * 2)
    section.plots(
        [matrix_plot({"elbow": {"backlash": 0.1}, "shoulder": {"coulomb_friction": 0.9}})], "matrix"
    )
    section.plots([ranking_plot(VERDICT.ranking)[0]], "ranking")
    split = Split("band_hz", "elbow_q", "elbow", (0.0, 1.0, 5.0), (0.1, 0.9), (1.0, 0.0), (False, True))
    section.plots([share_plot(split)], "shares")
    section.plots([correlation_plot(["a", "b"], np.array([[1.0, -0.5], [-0.5, 1.0]]))], "correlations")
    section.code('<joint name="elbow" ' + 'solimpfriction="0.9 0.95 0.001 0.5 2" ' * 5 + "/>")
    return page


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_a_report_is_drawn_whole_at_every_width_and_in_both_schemes(tmp_path):
    path = tmp_path / "report.html"
    report().write(path)
    shown_whole(path)
    with browser() as tab:
        tab.open(path.as_uri(), width=420, scheme="light", ready="document.documentElement.dataset.drawn > 0")
        # answers and picture are on the first screen of a telephone
        assert tab.ask("document.querySelector('.plot').getBoundingClientRect().bottom") < 900


def test_page_and_console_give_the_same_answers():
    text = report().to_html()
    table = verdict_summary(VERDICT, FILES)[1]
    told = [str(cell) for cell in table.columns[1].cells]
    assert told[: len(answers(VERDICT))] == [a.answer for a in answers(VERDICT)]
    for found in answers(VERDICT):
        assert f"<dt>{found.question}</dt><dd>{found.answer}</dd>" in text
    assert f"jointbench apply {FILES.verdict} {FILES.model} -o corrected.xml" in text
    assert dict(answers(VERDICT))["How far"].startswith(
        "0.145 → 0.00551 (NRMSE of elbow; noise alone 0.0051)"
    )


def test_answers_of_unknown_and_of_none_name_no_effect():
    unknown = replace(VERDICT, verdict="unknown", named=(), nearest=(FRICTION,), complete=False)
    told = dict(answers(unknown))
    assert told["Where"] == "elbow, elbow_q (90 %, 1 to 5 Hz)"
    assert told["Which"] == "none of the catalogue; nearest: coulomb_friction (elbow)"
    assert next_steps(unknown, FILES)[0].command.endswith("--nearest")
    # of logs there is no case folder yet, which the command that applies runs its records from
    drafted = FILES._replace(draft="jointbench init run.csv arm.xml -o case")
    assert [step.command for step in next_steps(VERDICT, drafted)][:1] == [drafted.draft]
    none = replace(VERDICT, verdict="none", named=(), locations=())
    assert dict(answers(none))["Which"] == "no effect is missing"
    assert not any(step.command for step in next_steps(none, FILES))
    rough = dict(answers(replace(none, complete=False)))
    assert rough["Which"] == "no effect of the catalogue"
    assert "noise" not in rough["Where"]


def test_a_diverged_run_in_the_users_simulator_is_not_drawn():
    good = runs()["measured"]["elbow"]
    assert APPLIED in with_applied(runs(), TOLD._replace(record={"elbow": good}))
    for bad in (1e9 * good, good[:-1], np.full_like(good, np.nan)):
        assert APPLIED not in with_applied(runs(), TOLD._replace(record={"elbow": bad}))


def test_rankings_hold_no_empty_bars():
    figure, hidden = ranking_plot(VERDICT.ranking)
    assert list(figure.data[0].y) == ["coulomb_friction (elbow)"]
    assert hidden == 1
    assert min(figure.data[0].x) >= SETTINGS.likely


def test_a_page_is_one_file_of_a_bounded_size(tmp_path: Path):
    text = report().to_html()
    assert len(text) < 6_000_000
    assert "src=" not in text.partition("<script")[0]
    assert "http://" not in text
    assert "https://" not in text


def test_many_effects_are_told_by_name_and_few_with_their_numbers():
    laws = [("coulomb_friction", f"joint_{k}") for k in range(1, 4)] + [
        ("damping_error", f"joint_{k}") for k in range(1, 7)
    ]
    named = tuple(
        NamedEffect(
            name,
            where,
            0.9 - 0.1 * (k > 4),
            {"limit": Estimate(1.0 + k, 0.1, "N m")},
            closed=0.5 / (k + 1),
            closed_ci95=(0.0, 0.6),
        )
        for k, (name, where) in enumerate(laws)
    )
    assert by_name(named[:4]) == "coulomb_friction (joint_1, joint_2, joint_3), damping_error (joint_1)"
    told = dict(answers(replace(VERDICT, named=named)))
    assert told["Which"].count("limit") == 3
    assert (
        "and of less weight damping_error (joint_1, joint_2, joint_3, joint_4, joint_5, joint_6)"
        in told["Which"]
    )
    assert "the 6 others 0.800 to 0.900, up to 12 % each" in told["How sure"]
