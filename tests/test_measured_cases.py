"""Grades of measured cases, by what was written down before the run."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from measured.acceptance import Acceptance, acceptance_of, acceptances  # noqa: E402

PLAY = Acceptance((frozenset({"backlash_friction"}),), frozenset({"force_offset"}), nrmse=0.2)
CLEAN = Acceptance((frozenset(),))


PLACED = Acceptance((frozenset({"backlash@knee"}),), frozenset({"coulomb_friction@hip"}))


def placed(*named: tuple[str, str], sets=()):
    entries = [{"name": name, "where": where, "probability": 0.95} for name, where in named]
    return {"verdict": "effect", "named": entries, "indistinguishable": sets, "gap": {"after": 0.1}}


def verdict(kind: str, named: dict[str, float], sets=(), after: float | None = 0.1):
    return {
        "verdict": kind, "named": [{"name": n, "probability": p} for n, p in named.items()],
        "indistinguishable": sets, "gap": {"after": after},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("wanted", "said", "grade"),
    [
        (PLAY, verdict("effect", {"backlash_friction": 0.7}), "right"),
        (PLAY, verdict("effect", {"backlash_friction": 0.7, "force_offset": 0.9}), "right"),
        (PLAY, verdict("effect", {"backlash_friction": 0.7, "gap": 0.95}), "wrong"),
        (PLAY, verdict("effect", {"backlash_friction": 0.7}, after=0.5), "honest"),
        (PLAY, verdict("effect", {"backlash_friction": 0.7}, after=None), "honest"),
        (PLAY, verdict("effect", {"pinching_hysteresis": 0.97}), "wrong"),
        (PLAY, verdict("effect", {"pinching_hysteresis": 0.6}), "honest"),
        (
            PLAY,
            verdict("effect", {"pinching_hysteresis": 0.97}, [["backlash_friction", "pinching_hysteresis"]]),
            "honest",
        ),
        (PLAY, verdict("effect", {"pinching_hysteresis": 0.97}, [["gap", "pinching_hysteresis"]]), "wrong"),
        (PLAY, verdict("unknown", {}), "honest"),
        (PLAY, verdict("none", {}), "wrong"),
        (CLEAN, verdict("none", {}), "right"),
        (CLEAN, verdict("effect", {"gap": 0.97}), "wrong"),
        (PLACED, placed(("backlash", "knee")), "right"),
        (PLACED, placed(("backlash", "knee"), ("coulomb_friction", "hip")), "right"),
        (PLACED, placed(("backlash", "hip")), "wrong"),
        (PLACED, placed(("backlash", "knee"), ("coulomb_friction", "ankle")), "wrong"),
        (
            PLACED,
            placed(
                ("backlash", "knee"),
                ("stribeck_friction", "hip"),
                sets=[["coulomb_friction", "stribeck_friction"]],
            ),
            "honest",
        ),
    ],
)
def test_a_verdict_is_graded_by_what_was_written_down(wanted, said, grade):
    assert wanted.grade(said) == grade


def test_a_refusal_is_right_where_it_says_what_is_wrong():
    wanted = Acceptance((frozenset({"acceleration_gain_error"}),), refusal=("'acceleration'", "in g"))
    assert wanted.refused("is 'acceleration' in g?") == "right"
    assert wanted.refused("'acceleration' has a gap") == "refused"
    assert PLAY.refused("is 'acceleration' in g?") == "refused"


def test_every_measured_case_has_an_entry_and_the_longest_name_counts(tmp_path):
    known = acceptances()
    sources = {path.stem for path in (SCRIPTS / "measured").glob("[a-z]*.py")} - {"acceptance", "target"}
    assert sources == set(known)
    assert all(entry.why for entry in known.values())
    own = tmp_path / "acceptance.json"
    own.write_text(json.dumps({"cases": {"a": {"right": [["gap"]]}, "ab": {"right": [[]]}}}))
    found = acceptances(own)
    assert acceptance_of("abc", found) == found["ab"]
    assert acceptance_of("b", found) is None
