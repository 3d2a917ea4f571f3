"""Records of more samples than a search makes use of: thinned, cut, and what is found held against what follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_cases import NOISE, SAMPLE_RATE, load, motion_with, planted_case

from bench.discrepancy import Case, diagnose, record_from_arrays
from bench.discrepancy.checks.long_records import after, long_record_notes, thinned, with_beginnings
from bench.discrepancy.settings import DEFAULT, ChecksSettings, DiagnosisSettings
from bench.discrepancy.settings.checks import LongRecordSettings


def limited(record: int, together: int = 10**6) -> DiagnosisSettings:
    return replace(
        DEFAULT, checks=ChecksSettings(long_records=LongRecordSettings(record=record, together=together))
    )


def case_of(*lengths: int, rate: float = 100.0, noise: float = 1e-3, top: float = 2.0) -> Case:
    """Records of a slow force and displacement; nothing but white noise lies above `top`, in Hz."""
    rng = np.random.default_rng(4)
    records = []
    for index, n in enumerate(lengths):
        time = np.arange(n) / rate
        slow = sum(np.sin(2.0 * np.pi * f * time + f) - np.sin(f) for f in (0.4, 0.9, top))
        values = {
            "force": slow + noise * rng.standard_normal(n),
            "displacement": 0.1 * slow + 0.1 * noise * rng.standard_normal(n),
            "acceleration": -slow + noise * rng.standard_normal(n),
        }
        records.append(record_from_arrays(f"record_{index}", time, values))
    case = planted_case(n=300)
    noises = {"force": noise, "displacement": 0.1 * noise, "acceleration": noise}
    channels = tuple(replace(c, noise_std=noises[c.name]) for c in case.channels)
    return replace(case, channels=channels, identification=tuple(records), validation=())


def lengths(case: Case) -> list[int]:
    return [len(record) for record in case.identification]


def test_the_longest_records_are_cut_to_one_length_and_short_ones_stay_whole():
    case = case_of(300, 5000, 9000)
    assert lengths(with_beginnings(case, settings=limited(4000))) == [300, 4000, 4000]
    assert lengths(with_beginnings(case, settings=limited(4000, 5300))) == [300, 2500, 2500]
    assert lengths(with_beginnings(case, settings=limited(9000))) == [300, 5000, 9000]
    cut = with_beginnings(case, settings=limited(4000)).identification[2]
    rest = after(case.identification[2], cut)
    assert rest is not None
    assert (len(rest), rest.at_rest) == (5000, False)
    assert rest.values["force"][0] == case.identification[2].values["force"][4000]
    assert after(case.identification[0], case.identification[0]) is None


def test_a_record_that_is_cut_begins_where_something_begins_to_move():
    case = case_of(9000)
    (record,) = case.identification
    still = np.zeros(30_000)
    values = {name: np.concatenate([still, samples]) for name, samples in record.values.items()}
    silent = replace(record, values=values, bridged=(29_990,))
    case = replace(case, identification=(silent,))
    (cut,) = with_beginnings(case, settings=limited(4000)).identification
    first = round(cut.start * 100.0)
    # within two blocks of a sixty-fourth of what is kept
    assert 30_000 - 2 * 4000 / 64 <= first <= 30_000
    assert cut.at_rest
    assert cut.bridged == (29_990 - first,)
    assert long_record_notes(case, case) == ()
    (told,) = long_record_notes(case, with_beginnings(case, settings=limited(4000)), settings=limited(4000))
    assert "39000 samples" in told
    assert f"{cut.start:.6g} to {cut.start + 40.0:.6g} s" in told


def test_a_record_is_thinned_as_far_as_nothing_but_noise_is_lost():
    settings = limited(5000)
    (kept,) = thinned(case_of(40_000, rate=1000.0), settings=settings).identification
    assert kept.step == pytest.approx(8e-3)  # eight times too long
    assert len(kept) == 5000
    # a spectrum is smoothed over a two hundredth of it, 2.5 Hz here, and the next band counts, too: 20 Hz
    case = case_of(40_000, rate=1000.0, top=15.0)
    (kept,) = thinned(case, settings=settings).identification
    assert kept.step == pytest.approx(5e-3)
    (told,) = long_record_notes(case, thinned(case, settings=settings), settings=settings)
    assert "one sample of 5" in told
    assert "40000 samples" in told


def test_a_record_is_not_thinned_where_that_would_change_what_it_holds():
    case = case_of(40_000, rate=1000.0)
    held = replace(case, options={"load_interpolation": "zero_order_hold"})
    broad = replace(case, channels=tuple(replace(c, noise_std=1e-6) for c in case.channels))
    periodic = replace(case, identification=(replace(case.identification[0], periodic=True),))
    for same in (held, broad, periodic):
        assert lengths(thinned(same, settings=limited(5000))) == [40_000]
    assert lengths(thinned(case, settings=limited(40_000))) == [40_000]


def long_case(later: float) -> Case:
    """Sixteen seconds with a cubic spring, to which a linear one is added after eight."""
    n = 8000

    def spring(x: float, v: float, z: list[float]) -> tuple[float, list[float]]:
        return 4e6 * x**3 + (later * x if z[0] > 8.0 else 0.0), [1.0]

    case, rng, force = planted_case(n=3000), np.random.default_rng(3), load(5, n)
    x, a = motion_with(force, spring, hidden=1)
    values = {
        "force": force,
        "displacement": x + NOISE["displacement"] * rng.standard_normal(n),
        "acceleration": a + NOISE["acceleration"] * rng.standard_normal(n),
    }
    record = record_from_arrays("identification", np.arange(n) / SAMPLE_RATE, values)
    x, a = motion_with(load(6, 3000), spring, hidden=1)
    values = {
        "force": load(6, 3000),
        "displacement": x + NOISE["displacement"] * rng.standard_normal(3000),
        "acceleration": a + NOISE["acceleration"] * rng.standard_normal(3000),
    }
    judging = record_from_arrays("validation", np.arange(3000) / SAMPLE_RATE, values)
    return replace(case, identification=(record,), validation=(judging,))


@pytest.mark.slow
@pytest.mark.parametrize(("later", "changes"), [(0.0, False), (200.0, True)])
def test_what_is_found_at_the_beginning_is_held_against_what_follows(later: float, changes: bool):
    verdict = diagnose(long_case(later), settings=limited(3000)).verdict
    assert [effect.name for effect in verdict.named] == ["cubic_stiffness"]
    (told,) = [warning for warning in verdict.warnings if "in what follows" in warning]
    assert ("something changes with time" in told) == changes
    assert any("8000 samples" in w and "0 to 6 s" in w for w in verdict.warnings)
