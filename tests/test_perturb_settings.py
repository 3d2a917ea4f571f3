"""Which thresholds a diagnosis reads, and what a perturbed one is."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "scripts"))

from perturb_settings import Args, Task, changes, defaults, moved, reading, tasks

from bench.discrepancy.settings import DEFAULT, described


def test_thresholds_that_are_read_are_noted_and_no_others():
    with reading() as read:
        assert read() == []
        least = DEFAULT.likelihood.error.least
        assert DEFAULT.search.timed
        assert read() == ["likelihood.error.least"]
    assert DEFAULT.likelihood.error.least == least
    assert DEFAULT.judgement.far > 0.0
    assert read() == ["likelihood.error.least"]  # nothing is noted afterwards


def test_a_moved_threshold_is_one_of_its_kind():
    entries = list(described(DEFAULT))
    for entry in entries:
        old = list(entry.default) if isinstance(entry.default, tuple) else [entry.default]
        for factor in (1.5, 1.0 / 1.5):
            value = moved(entry, factor)
            new = value if isinstance(value, list) else [value]
            assert [type(v) for v in new] == [type(v) for v in old], entry.path
            if entry.meaning.lower().startswith("share"):
                assert max(new) < 1.0, entry.path
    assert len(entries) > 300


def test_only_what_a_case_reads_is_run_on_it_and_changes_are_tabled(tmp_path):
    args = Args((tmp_path / "one", tmp_path / "two"))
    one, two = defaults(args)
    known = {
        one.key: {**one._asdict(), "verdict": "effect", "named": ["gap"], "read": ["numerics.patience"]},
        two.key: {**two._asdict(), "verdict": "none", "named": [], "read": []},
    }
    found = list(tasks(args, known))
    assert {task.case for task in found} == {one.case}
    assert {task.path for task in found} == {"numerics.patience"}
    more, fewer = found
    known[more.key] = {**more._asdict(), "verdict": "effect", "named": ["gap"]}
    known[fewer.key] = {**fewer._asdict(), "verdict": "unknown", "named": []}
    (row,) = changes(args, known)
    assert row["setting"] == "numerics.patience"
    assert row["value"] == fewer.value
    assert (row["before"], row["after"]) == ("effect gap", "unknown")
    assert Task(*more).key == more.key
