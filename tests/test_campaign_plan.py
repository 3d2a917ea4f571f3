"""Plans of campaigns: distributions, designs, reading and checking."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
import sys
import tomllib
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from bench.campaign import (
    Choice,
    Integers,
    LogUniform,
    Normal,
    Plan,
    Uniform,
    plan_from_dict,
    read_plan,
    run_campaign,
    size,
)
from bench.campaign.distribution import Distribution
from bench.campaign.drawing import dimension, draw_at, draws, point_of
from bench.campaign.generation import Generator
from bench.campaign.nest import leaves
from bench.campaign.plan import PLAN_LIMITS
from bench.campaign.quantities import read_quantity
from bench.campaign.tables import part_contents
from bench.errors import BenchError, FileFormatError, ParameterError, UnknownNameError
from bench.files import OutputError

EXAMPLES = Path(__file__).parents[1] / "examples"


def document(**changes) -> dict:
    return {
        "name": "test",
        "seed": 5,
        "records": 64,
        "duration": 0.1,
        "sample_rate": 1000.0,
        "rigs": [
            {
                "rig": "sdof",
                "structure": {"mass": {"carriage": {"uniform": [1.0, 3.0]}}},
                "elements": [
                    {
                        "law": "gap",
                        "joints": ["carriage"],
                        "parameters": {"clearance": {"log_uniform": [1e-4, 1e-2]}},
                    }
                ],
            }
        ],
        "excitations": [{"signals": {"shaker": {"type": "harmonic", "frequency": {"uniform": [1.0, 9.0]}}}}],
    } | changes


def varied() -> dict:
    """Two rigs, two excitations, sensors, shared quantities, an element that half of the records have."""
    base = document()
    base["shared"] = {"level": {"log_uniform": [1.0, 4.0]}}
    base["rigs"][0]["elements"][0] |= {"probability": 0.5, "name": "stop"}
    linear = {
        "law": "linear",
        "joints": ["carriage"],
        "parameters": {"stiffness": {"shared": "level", "times": 100.0}},
    }
    base["rigs"].append({"rig": "sdof", "name": "spring", "weight": 3.0, "elements": [linear]})
    base["excitations"].append(
        {
            "name": "noise",
            "rigs": ["spring"],
            "signals": {"shaker": {"type": "band_limited_noise", "cutoff": 40.0, "rms": {"shared": "level"}}},
        }
    )
    base["sensors"] = [{"chains": {"displacement": [{"type": "noise", "std": {"choice": [1e-5, 1e-4]}}]}}]
    return base


@given(u=st.floats(0.0, 1.0, exclude_max=True))
def test_quantiles_are_those_of_the_distributions(u: float) -> None:
    # relative 1e-9: two ways through the error function and its inverse, which agree to about 1e-13 away from the ends
    assert Uniform(2.0, 5.0).at(u) == pytest.approx(stats.uniform(2.0, 3.0).ppf(u), rel=1e-12)
    assert LogUniform(1e-3, 1e3).at(u) == pytest.approx(stats.loguniform(1e-3, 1e3).ppf(u), rel=1e-9)
    truncated = stats.truncnorm(-2.0, 1.5, loc=1.0, scale=2.0)
    assert Normal(1.0, 2.0, low=-3.0, high=4.0).at(u) == pytest.approx(truncated.ppf(u), rel=1e-7, abs=1e-7)
    assert Integers(3, 7).at(u) == 3 + int(5 * u)
    assert Choice((1.0, 2.0, 3.0), (1.0, 0.0, 3.0)).at(u) == (1.0 if u < 0.25 else 3.0)


def test_normal_stays_finite_at_the_ends() -> None:
    assert all(np.isfinite(Normal(0.0, 1.0).at(u)) for u in (0.0, 1.0 - 2.0**-53))


@pytest.mark.parametrize("sampling", ["latin_hypercube", "sobol", "random"])
def test_design_covers_the_cube_as_it_says(sampling: str) -> None:
    plan = plan_from_dict(document(sampling=sampling))
    points = np.array([point_of(plan, k) for k in range(64)])
    assert points.shape == (64, dimension(plan))
    strata = np.sort(np.floor(points * 64).astype(int), axis=0)
    stratified = np.array_equal(strata, np.tile(np.arange(64)[:, None], (1, points.shape[1])))
    # one point a stratum in each coordinate: both designs promise it for 64 points; 64 random numbers do it with odds of 1e-27
    assert stratified == (sampling != "random")


def test_draws_do_not_depend_on_which_records_are_asked_for() -> None:
    for sampling in ("random", "latin_hypercube", "sobol"):
        plan = plan_from_dict(varied() | {"sampling": sampling})
        together = draws(plan, range(64))
        assert [draws(plan, [k])[0] for k in reversed(range(64))] == together[::-1]


def test_shares_of_rigs_and_elements_follow_their_weights() -> None:
    plan = plan_from_dict(varied() | {"sampling": "sobol", "records": 1024})
    drawn = draws(plan, range(1024))
    # a Sobol sequence of 2^10 points halves and quarters every coordinate exactly
    assert sum(draw.rig for draw in drawn) == 768
    present = [draw.present[0] for draw in drawn if draw.rig == 0]
    # which 256 points have the first rig depends on another coordinate: within four standard deviations of 128
    assert abs(sum(present) - 128) < 4 * 8
    assert all(draw.excitation == 0 for draw in drawn if draw.rig == 0)


def test_shared_quantities_vary_together() -> None:
    plan = plan_from_dict(varied())
    noisy = [draw for draw in draws(plan, range(64)) if draw.excitation == 1]
    assert len({draw.values["excitation/shaker/rms"] for draw in noisy}) == len(noisy) > 5
    for draw in noisy:
        assert draw.values["carriage.linear/stiffness"] == 100.0 * float(draw.values["excitation/shaker/rms"])


def test_plan_survives_its_own_document() -> None:
    plan = plan_from_dict(varied())
    again = plan_from_dict(json.loads(json.dumps(plan.to_dict())))
    assert again == plan
    assert again.sha256 == plan.sha256
    assert dataclasses.replace(plan, seed=6).sha256 != plan.sha256


PLANS = [path for path in sorted(EXAMPLES.glob("*.toml")) if "records" in tomllib.loads(path.read_text())]


@pytest.mark.parametrize("path", PLANS, ids=lambda path: path.stem)
def test_examples_are_campaigns_that_would_run(path: Path) -> None:
    plan = read_plan(path)
    Generator(plan).check()
    values = [draw_at(plan, 0, np.full(dimension(plan), u)).values for u in (0.1, 0.9)]
    assert values[0] != values[1]


def test_parts_hold_every_record_once() -> None:
    plan = plan_from_dict(document(records=1001, records_per_part=10))
    assert [record for part in range(plan.n_parts) for record in plan.part(part)] == list(range(1001))


def test_quantities_are_found_wherever_they_stand() -> None:
    noise = {
        "type": "sum",
        "signals": [{"type": "constant", "value": Uniform(0.0, 1.0)}, {"type": "sweep", "band": [1.0, 2.0]}],
    }
    assert [path for path, _ in leaves(noise, "e")] == ["e/signals/0/value"]


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"recrods": 3}, UnknownNameError, "recrods"),
        ({"records": 0}, ParameterError, "at least 1"),
        ({"duration": 0.0999}, ParameterError, "whole number of samples"),
        ({"sampling": "grid"}, UnknownNameError, "latin_hypercube"),
        ({"rigs": []}, ParameterError, "rigs: .* at least 1"),
        ({"rigs": [{"name": "a"}]}, ParameterError, "rig missing"),
        (
            {"rigs": [{"rig": "sdof", "elements": [{"law": "gpa", "joints": ["carriage"]}]}]},
            UnknownNameError,
            "gap",
        ),
        (
            {"rigs": [{"rig": "sdof", "structure": {"mass": {"carriage": {"unifrom": [1, 2]}}}}]},
            UnknownNameError,
            "uniform",
        ),
        (
            {"rigs": [{"rig": "sdof", "structure": {"mass": {"carriage": {"uniform": [2, 1]}}}}]},
            ParameterError,
            "empty",
        ),
        (
            {"rigs": [{"rig": "sdof", "structure": {"mass": {"carriage": {"shared": "level"}}}}]},
            UnknownNameError,
            "level",
        ),
        ({"excitations": [{"signals": {}}]}, ParameterError, "signals"),
        (
            {"sensors": [{"chains": {"displacement": {"type": "noise"}}}]},
            ParameterError,
            "chains.displacement: .* a list is expected",
        ),
        (
            {"excitations": [{"prescribe": "piston", "signals": {"shaker": {"type": "constant"}}}]},
            ParameterError,
            "one signal",
        ),
    ],
)
def test_mistakes_in_plans_are_named(change: dict, error: type[BenchError], words: str) -> None:
    with pytest.raises(error, match=words):
        plan_from_dict(document(**change))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"channels": ["displcement"]}, "displacement"),
        ({"excitations": [{"signals": {"shakr": {"type": "harmonic", "frequency": 2.0}}}]}, "shaker"),
        ({"excitations": [{"signals": {"shaker": {"type": "harmonic", "frequency": 600.0}}}]}, "600"),
        ({"sensors": [{"chains": {"displacment": [{"type": "noise", "std": 1.0}]}}]}, "displacement"),
        ({"rigs": [{"rig": "sdof", "structure": {"mass": {"carraige": 2.0}}}]}, "carriage"),
        ({"rigs": [{"rig": "sdof", "timestep": 0.0003}]}, "divide"),
        ({"rigs": [{"rig": "joint"}]}, "axial_torsional_joint"),
        (
            {
                "sample_rate": 1024.0,
                "duration": 0.125,
                "rigs": [{"rig": "damper", "structure": {"mass": {"piston": 2.0}}}],
                "excitations": [
                    {"prescribe": "piston", "signals": {"piston": {"type": "harmonic", "frequency": 2.0}}}
                ],
            },
            "prescribes a motion",
        ),
    ],
)
def test_mistakes_against_the_rigs_are_found_before_anything_runs(change: dict, words: str) -> None:
    with pytest.raises(BenchError, match=words):
        Generator(plan_from_dict(document(**change))).check()


def test_a_channel_of_a_withheld_element_is_refused() -> None:
    plan = document(channels=["carriage.gap/force"])
    Generator(plan_from_dict(plan))
    plan["rigs"][0]["elements"][0]["withheld"] = True
    with pytest.raises(ParameterError, match="give it away"):
        Generator(plan_from_dict(plan))


def test_large_hypercubes_are_refused_with_a_way_out() -> None:
    plan = plan_from_dict(document(records=50_000_000, records_per_part=5000, sampling="latin_hypercube"))
    with pytest.raises(ParameterError, match="sobol"):
        point_of(plan, 0)


def test_unreadable_plans_are_file_errors(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError):
        read_plan(tmp_path / "none.toml")
    (tmp_path / "torn.toml").write_text("[[rigs")
    with pytest.raises(FileFormatError):
        read_plan(tmp_path / "torn.toml")


@given(
    st.recursive(
        st.one_of(st.none(), st.booleans(), st.floats(), st.text()), lambda x: st.dictionaries(st.text(), x)
    )
)
def test_any_value_is_a_quantity_or_a_named_error(entry) -> None:
    try:
        quantity = read_quantity(entry, "x")
    except BenchError:
        return
    assert isinstance(quantity, bool | int | float | str | Distribution)


def test_reading_a_plan_loads_nothing_heavy() -> None:
    code = (
        "import sys; from bench.campaign import read_plan; read_plan('examples/campaign.toml'); "
        "print([name for name in ('mujoco', 'numba', 'pyarrow', 'torch', 'distributed', 'minari') if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=EXAMPLES.parent, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_plan_is_a_value() -> None:
    plan = plan_from_dict(document())
    assert isinstance(plan, Plan)
    with pytest.raises(dataclasses.FrozenInstanceError):
        plan.seed = 3  # type: ignore[misc]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"records": 10**9}, r"1 000 000 000 records of 100 samples are 0\.4 TB a channel"),
        ({"records": 10**18}, "at most 100000000 records"),
        ({"records": 10**5000}, r"about 10\^5000 records"),
        ({"records": 10**7, "records_per_part": 2}, f"at most {PLAN_LIMITS.parts} parts"),
        ({"records": 10**8, "records_per_part": 5000, "duration": 1.0}, "TB, which do not fit"),
        ({"duration": 1e9}, r"64 records of 1e\+12 samples"),
        ({"duration": 1e300}, f"at most {PLAN_LIMITS.samples} samples a record"),
        ({"duration": 1e9, "sample_rate": 1e-6}, "TB while it is made"),
        ({"sample_rate": 1e7}, "does not divide"),
        ({"records_per_part": 10**7, "records": 10**7, "duration": 1.0}, "while it is made"),
        ({"records": 10**7, "records_per_part": 1000, "sampling": "latin_hypercube"}, "sobol"),
    ],
)
def test_plans_that_cannot_be_are_refused_with_their_size(
    changes: dict, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a machine of 64 GB with 1 TB free, before anything is allocated or written."""
    monkeypatch.setattr(size, "memory_bytes", lambda: 64e9)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=1e12))
    tracemalloc.start()
    with pytest.raises((ParameterError, OutputError), match=told):
        run_campaign(document(**changes), tmp_path / "never", threads=2)
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()
    assert not (tmp_path / "never").exists()


def test_the_size_of_a_part_is_what_it_takes() -> None:
    """Against the arrays that a part and its batch really hold, within a factor of two: it is a bound to refuse by."""
    generator = Generator(plan_from_dict(document(records=6, duration=20.0)))
    part_contents(generator, generator.part(0))  # what is imported and compiled on the way is none of it
    tracemalloc.start()
    contents = part_contents(generator, generator.part(0))
    measured = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 0.5 < size.part_bytes(generator) / (measured + sum(map(len, contents.values()))) < 2.0
