"""The harness behind the benchmarks, and that a peer is given the same problem."""

from __future__ import annotations

import importlib
import inspect
import itertools
import json
import sys
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

import benchmark
from benchmarks.timing import Row, interleave, ratio_row

from bench.discrepancy import BlindOptions


def _row(ratio: float, limit: str) -> Row:
    return Row("a", ratio, (ratio, ratio), limit, "", {})


@pytest.mark.parametrize(
    ("ratio", "limit", "holds"),
    [
        (0.96, "≥ 0.95", True),
        (0.95, "≥ 0.95", True),
        (0.94, "≥ 0.95", False),
        (1.4, "≤ 1.5", True),
        (1.6, "≤ 1.5", False),
        (3.0, "", None),
    ],
)
def test_limit_decides_whether_a_row_holds(ratio, limit, holds):
    assert _row(ratio, limit).holds is holds
    assert _row(ratio, limit).to_dict()["holds"] is holds


def test_tasks_take_turns_in_alternating_order_after_an_uncounted_round():
    order: list[str] = []
    seconds = interleave({name: lambda name=name: order.append(name) for name in "abc"}, 3)
    assert {name: values.shape for name, values in seconds.items()} == dict.fromkeys("abc", (3,))
    rounds = ["".join(order[i : i + 3]) for i in range(0, len(order), 3)]
    assert len(rounds) == 4
    assert set(rounds) == {"abc", "cba"}
    assert all(one != two for one, two in itertools.pairwise(rounds))


def test_ratio_is_taken_pair_by_pair():
    ours, peer = np.array([1.0, 2.0, 4.0]), np.array([3.0, 6.0, 12.0])
    row = ratio_row("a", ours, peer, limit="≥ 2", meaning="b", detail={"c": 1})
    assert (
        row.ratio == 3.0
    )  # a common slowdown of the machine cancels: medians of each side first would not do this
    assert row.spread == (3.0, 3.0)
    assert row.detail == {"ours_s": 2.0, "peer_s": 6.0, "c": 1}
    assert row.holds


@pytest.mark.slow
def test_solve_ivp_is_given_the_same_motion_as_mujoco_and_the_compiled_loop():
    from benchmarks import accuracy

    from bench import joint_rig
    from bench.identification.linear_rig import LinearRig

    for problem in accuracy.problems():
        step = 1e-3 if problem.driven else 1e-3 * problem.every
        rig = LinearRig.of(joint_rig(timestep=step), accuracy.CHANNELS)
        # the error of a tolerance of 1e-11 adds up over some thousand steps and kinks
        assert problem.error(problem.compiled(rig, 1e-11)) < 1e-8
        # at 20 steps a millisecond kinks of the gaps leave 3e-7
        assert problem.error(problem.mujoco(20)[0]) < 1e-6


def test_every_group_gives_rows_and_peers_are_no_groups():
    assert {"accuracy", "campaign", "diagnosis", "envs", "identify", "native", "stream"} <= set(
        benchmark.GROUPS
    )
    for group in benchmark.GROUPS:
        assert "repeats" in inspect.signature(importlib.import_module(f"benchmarks.{group}").rows).parameters


def test_results_are_saved_and_compared(tmp_path, monkeypatch, capsys):
    from benchmarks import stream

    held = [_row(2.0, "≥ 1"), Row("b", 0.5, (0.4, 0.6), "≥ 1", "", {})]
    for name, chosen, status in (("one", held[:1], 0), ("two", held, 1)):
        monkeypatch.setattr(stream, "rows", lambda repeats, chosen=chosen: chosen)
        monkeypatch.setattr(sys, "argv", ["benchmark.py", "stream", "--json", "--save", str(tmp_path / name)])
        assert benchmark.main() == status  # a row whose limit does not hold fails the command
        told = json.loads(capsys.readouterr().out)
        assert told == json.loads((tmp_path / name).read_text(encoding="utf-8"))
        assert [row["holds"] for row in told["groups"]["stream"]] == [True, False][: len(chosen)]
    monkeypatch.setattr(
        sys, "argv", ["benchmark.py", "--compare", str(tmp_path / "one"), str(tmp_path / "two")]
    )
    assert benchmark.main() == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if "stream" in line]
    assert len(lines) == 2
    assert "–" in lines[1]  # the second row is not in the first file


QUIET = BlindOptions(
    noise=(1e-3, 1e-3), gap=(0.3, 0.3), duration=6.0, sample_rate=1000.0, sensors=("both",),
    shares=(0.0, 1.0, 0.0, 0.0), rigs=(1.0, 0.0, 0.0), detectability=False,
)  # fmt: skip


def _case(effect: str, seed: int, duration: float = QUIET.duration):
    import dataclasses

    from bench.discrepancy.blind.protocol import draw_case

    options = dataclasses.replace(QUIET, effects=(effect,), duration=duration)
    return draw_case(effect, np.random.default_rng(seed), options)[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "tolerance"),
    [
        ("gap", 2e-3),  # the peer holds each step's mean load: (omega h)^2 / 12 at the upper end of the band
        ("bouc_wen_hysteresis", 2e-3),
        ("coulomb_friction", 5e-2),  # MuJoCo's friction constraint is soft, ours sticks
        ("displacement_delay", 2e-3),
        ("mass_error", 2e-3),
    ],
)
def test_sysid_is_given_the_same_problem(effect, tolerance):
    from benchmarks.sysid_candidate import Candidate

    from bench.discrepancy.effects.catalogue import CATALOGUE
    from bench.discrepancy.likelihood.problem import Problem
    from bench.discrepancy.model.placements import placements
    from bench.discrepancy.model.rigs import structure_of

    case = _case("gap", 5)
    structure = structure_of(case)
    problem = Problem(case, structure, case.identification)
    placed = next(p for p in placements(case, structure, CATALOGUE) if p.effect.name == effect)
    candidate = Candidate(problem, placed)
    etas = [0.2 if p.signed else (p.grid[0] if p.grid else p.mean) for p in placed.effect.parameters]
    vector = np.concatenate([[0.5, -1.0, 0.3], etas])
    ours = problem.simulate((placed,), vector, case.validation[0])
    theirs = np.column_stack(list(candidate.predict(vector, case.validation[0]).values()))
    assert np.all(np.std(ours - theirs, axis=0) < tolerance * np.std(ours, axis=0))
    # and so is the cost that it minimises
    residual = problem.residual((placed,), vector)
    mean, std, *_ = problem.prior((placed,))
    own = float(residual @ residual + np.sum(((vector - mean) / std)[candidate.free] ** 2))
    assert candidate.cost(vector) == pytest.approx(own, rel=20 * tolerance)


@pytest.mark.slow
def test_sysid_names_an_effect_of_its_own_when_it_is_plain():
    from benchmarks import peer_sysid

    from bench.discrepancy.effects.catalogue import effect_named

    # the whole catalogue takes it minutes
    catalogue = [effect_named(name) for name in ("gap", "cubic_stiffness")]
    placed, _ = peer_sysid.diagnose(_case("gap", 5, 2.0), catalogue=catalogue, seconds=1e4)
    assert placed is not None
    assert placed.effect.name == "gap"


@pytest.mark.slow
def test_sysid_says_what_it_has_when_its_time_is_over():
    from benchmarks import peer_sysid

    case = _case("gap", 5)
    _, predict = peer_sysid.diagnose(case, seconds=0.0)
    assert all(np.isfinite(samples).all() for samples in predict(case.validation[0]).values())


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["cubic_stiffness", "quadratic_damping"])
def test_sparse_regression_names_what_its_library_holds(effect):
    from benchmarks import diagnosis

    answer = diagnosis.by_sindy(_case(effect, 5))
    assert [entry["name"] for entry in answer["named"]] == [effect]
    # derivatives of noisy records leave some bias: a tenth of a gap of 0.3 stays
    assert answer["gaps"][0]["after"] < 0.03


def test_rows_of_the_diagnosis_come_from_the_scores_of_all_tools():
    from benchmarks import diagnosis

    from bench.discrepancy import BlindScore

    def outcome(exact: float, seconds: float, after: float) -> diagnosis.Outcome:
        names = [entry.name for entry in fields(BlindScore) if entry.default is MISSING]
        known = {"exact": exact, "family": exact, "median_ratio": after}
        figures: dict[str, Any] = dict.fromkeys(names, float("nan")) | known
        return diagnosis.Outcome(BlindScore(**figures), seconds)

    mine = [outcome(1.0, 1.0, 1.0), outcome(1.0, 2.0, 1.0), outcome(float("nan"), 3.0, 1.0)]
    theirs = [outcome(1.0, 10.0, 2.0), outcome(0.0, 20.0, 2.0), outcome(float("nan"), 30.0, 4.0)]
    rows = {row.name.partition(",")[0]: row for row in diagnosis._against("mujoco.sysid", mine, theirs)}
    assert rows["single effects named exactly"].ratio == 2.0  # the clean case has no part in it
    assert rows["seconds a case"].ratio == 10.0
    assert rows["gap after over noise floor"].ratio == 2.0
    assert "clean cases called clean" not in rows  # no case was scored for it
    low, high = rows["single effects named exactly"].spread
    assert low <= 2.0 <= high


def test_memory_is_that_of_a_process_of_its_own():
    from benchmarks.new_process import in_new_process, memory_row

    lines, little = in_new_process("print('told')")
    _, much = in_new_process("taken = b'x' * 200_000_000")
    assert lines == ["told"]
    # the interpreter itself takes the same both times, to a few pages
    assert much - little == pytest.approx(2e8, rel=0.05)
    row = memory_row("of both", [little, much])
    assert row.ratio == pytest.approx(much / 1e9)
    assert row.holds
