"""The harness behind the benchmarks, and that a peer is given the same problem."""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from benchmarks.timing import Row, interleave, ratio_row


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
