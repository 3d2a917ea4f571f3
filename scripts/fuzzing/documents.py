"""Targets: the documents that the bench reads."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fuzzing.mutations import doubled, flipped, mutated


class Target(NamedTuple):
    """A reader under test.

    Attributes:
        make: Writes sound inputs into a folder, once.
        spoil: Spoils them.
        read: Reads them.
    """

    make: Callable[[Path], None]
    spoil: Callable[[Path, np.random.Generator], None]
    read: Callable[[Path], Any]


RIG: dict[str, Any] = {
    "$schema": "rig.json",
    "rig": "sdof",
    "name": "rig",
    "timestep": 1e-3,
    "integrator": "RK4",
    "structure": {"mass": {"carriage": 2.0}, "stiffness": {"carriage": 1500.0}},
    "elements": [
        {"law": "gap", "joints": ["carriage"], "name": "gap", "parameters": {"stiffness": 3e3, "clearance": 5e-3}},
        {"law": "iwan", "joints": ["carriage"], "header": [4], "exact": False, "inputs": []},
    ],
    "excitation": {
        "duration": 0.05,
        "sample_rate": 1000.0,
        "signals": {
            "shaker": {
                "type": "sum",
                "signals": [
                    {"type": "tapered", "fade_in": 0.01, "signal": {"type": "multisine", "band": [20.0, 80.0]}},
                    {"type": "stepped_sine", "frequencies": [40.0, 60.0], "amplitude": [1.0, 2.0], "dwell": 0.02},
                ],
            }
        },
    },
    "seed": 3,
}  # fmt: skip
EXPERIMENT: dict[str, Any] = {
    "duration": 1.0,
    "band": [0.5, 5.0],
    "force": {"shaker": 2.0},
    "energy": {"shaker": 10.0},
    "stroke": {"displacement": 0.04},
    "noise": {"displacement": 5e-4},
    "uncertain": {"gap.clearance": [0.005, 0.03]},
    "rival": {"elements": [{"law": "cubic_stiffness", "joints": ["carriage"], "name": "cubic"}]},
}
PLAN: dict[str, Any] = {
    "name": "plan",
    "seed": 11,
    "records": 4,
    "duration": 0.05,
    "sample_rate": 1000.0,
    "records_per_part": 2,
    "shared": {"level": {"uniform": [0.0, 1.0]}},
    "rigs": [
        {
            "rig": "sdof",
            "structure": {"mass": {"carriage": {"uniform": [1.0, 3.0]}}},
            "elements": [
                {
                    "law": "gap", "joints": ["carriage"], "probability": 0.5, "withheld": True,
                    "parameters": {"stiffness": {"log_uniform": [1e3, 1e4]}, "clearance": {"choice": [1e-3, 2e-3]}},
                }
            ],
        }
    ],
    "excitations": [
        {"signals": {"shaker": {"type": "band_limited_noise", "cutoff": 200.0, "rms": {"normal": [9.0, 1.0], "low": 5.0}}}}
    ],
    "sensors": [{"chains": {"displacement": [{"type": "noise", "std": {"shared": "level", "times": 1e-4}}]}}],
}  # fmt: skip
NOMINAL: dict[str, Any] = {
    "rig": "sdof",
    "sample_rate_hz": 100.0,
    "parameters": {
        "mass": {"value": 2.0, "std": 0.02, "unit": "kg"},
        "stiffness": {"value": 400.0, "std": 4.0, "unit": "N/m"},
    },
    "channels": {
        "time": {"unit": "s"},
        "force": {"unit": "N", "role": "measured", "noise_std": 0.01},
        "displacement": {
            "unit": "m", "noise_std": 1e-4,
            "antialias": {"kind": "butterworth", "order": 4, "cutoff_hz": 30.0, "records": ["validation"]},
        },
    },
    "load_interpolation": "linear",
    "starts_in_motion": ["validation"],
    "periodic": [],
    "window_s": 1.0,
    "limits": {"force": 3.0},
}  # fmt: skip
RESULT: dict[str, Any] = {
    "verdict": "effect",
    "named": [{"name": "gap", "where": "", "probability": 0.9, "parameters": {}}],
    "indistinguishable": [["gap", "cubic_stiffness"]],
    "gaps": [{"after": 0.02, "noise_floor": 0.01}],
    "probabilities": {"effect": 0.9, "none": 0.05, "unknown": 0.05},
    "locations": [{"dof": "x", "regions": [{"displacement": [0.1, None], "share": 0.5}]}],
    "seconds": 2.0,
}
ANSWER: dict[str, Any] = {
    "class": "single",
    "rig": "sdof",
    "effects": [{"name": "gap", "where": "", "parameters": [1.0]}],
    "struck": [],
    "regions": [{"dof": "", "coordinate": "displacement", "reach": 1.0, "intervals": [[0.2, 1.0]]}],
    "detectability": {"log_odds_none": 500.0, "log_odds_rival": 2.0, "rival": "cubic_stiffness"},
    "gap_nrmse_identification": [0.1],
    "noise": 0.01,
    "sensors": "both",
    "signals": ["sweep"],
}


def write(path: Path, document: Any) -> None:
    """Write a document as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document), encoding="utf-8")


def spoiler(*names: str) -> Callable[[Path, np.random.Generator], None]:
    """Spoils one of some JSON files."""

    def spoil(folder: Path, rng: np.random.Generator) -> None:
        path = folder / str(rng.choice(names))
        chance = rng.random()
        if chance < 0.05:
            path.write_bytes(flipped(path.read_bytes(), rng))
            return
        text = path.read_text(encoding="utf-8")
        text = doubled(text, rng) if chance < 0.15 else mutated(json.loads(text), rng)
        path.write_text(text, encoding="utf-8", errors="surrogatepass")

    return spoil


def read_rig(folder: Path) -> None:
    """Read a rig, compile and drive it."""
    from bench.rig import simulate
    from bench.rig.configuration import read_rig as read

    document, rig = read(folder / "rig.json")
    drive = document.drive
    if drive is not None and drive.n_samples <= 1000 and rig.timestep >= 1e-5:
        simulate(rig, drive, rng=np.random.default_rng(document.seed or 0))


def read_request(folder: Path) -> None:
    """Read a request for an excitation."""
    from bench.excitation.request import request
    from bench.excitation.schema import ExcitationRequest

    document = ExcitationRequest.read(folder / "rig.json")
    rig = document.build(folder)
    if document.experiment is not None and document.experiment.duration <= 10.0 and rig.timestep >= 1e-4:
        request(rig, document.experiment, draws=1, rng=np.random.default_rng(0))


def read_plan(folder: Path) -> None:
    """Read a plan and try it at its medians."""
    from bench.campaign import read_plan as read
    from bench.campaign.generation import Generator

    plan = read(folder / "plan.json")
    if plan.n_samples <= 1000:
        Generator(plan).check()


def make_case(folder: Path) -> None:
    """A case folder with records of a resonance."""
    write(folder / "nominal.json", NOMINAL)
    time = 0.01 * np.arange(400)
    for name, frequency in (("identification", 2.0), ("validation", 3.0)):
        columns = np.column_stack([time, np.sin(frequency * time), 0.002 * np.sin(frequency * time)])
        np.savetxt(
            folder / f"{name}.csv", columns, delimiter=",", header="time,force,displacement", comments=""
        )


def read_case(folder: Path) -> None:
    """Read a case and build its structure."""
    from bench.discrepancy.case.reading import read_case as read
    from bench.discrepancy.model.rigs import structure_of

    structure_of(read(folder))


def make_campaign(folder: Path) -> None:
    """A small campaign that is complete."""
    from bench.campaign import run_campaign

    run_campaign(PLAN, folder / "campaign")


def read_campaign(folder: Path) -> None:
    """Verify a campaign, read it in windows, and resume it."""
    from bench.campaign import Windows, run_campaign, verify
    from bench.errors import BenchError

    for use in (verify, lambda at: list(Windows(at, 10)), lambda at: run_campaign(PLAN, at)):
        try:
            use(folder / "campaign")
        except BenchError:
            continue


def make_policy(folder: Path) -> None:
    """A policy with a memory, which comes with the package."""
    from bench.excitation.policy import FOLDER

    (folder / "policy.npz").write_bytes((FOLDER / "rivals.npz").read_bytes())


def make_plans(folder: Path) -> None:
    """A policy of plans, which comes with the package."""
    from bench.excitation.policy import FOLDER

    (folder / "policy.npz").write_bytes((FOLDER / "sdof.npz").read_bytes())


def spoil_policy(folder: Path, rng: np.random.Generator) -> None:
    """Spoil its header, one of its arrays, or the bytes of the archive."""
    path = folder / "policy.npz"
    chance = rng.random()
    if chance < 0.2:
        path.write_bytes(flipped(path.read_bytes(), rng))
        return
    with np.load(path, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    (document,) = {"document", "plan_document"} & set(arrays)
    if chance < 0.8:
        text = mutated(json.loads(str(arrays[document])), rng)
        arrays[document] = np.array(text.encode("utf-8", "replace").decode("utf-8").rstrip("\x00"))
    else:
        name = str(rng.choice(sorted(arrays)))
        array = arrays.pop(name)
        odd = (
            [np.zeros((0,)), np.full(3, np.nan), array.T, np.array("text"), array.astype("f8") * 1e300]
            if name != document
            else []
        )
        if odd and rng.random() < 0.8:
            with np.errstate(all="ignore"):
                arrays[name] = odd[int(rng.integers(len(odd)))]
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    path.write_bytes(stream.getvalue())


def read_policy(folder: Path) -> None:
    """Load a policy and let it act."""
    from bench.excitation import find_policy

    policy = find_policy(str(folder / "policy.npz"))
    action = policy.act(np.zeros(policy.station.n_observations, dtype=np.float32), policy.memory())
    assert np.isfinite(action).all(), "a policy was accepted that acts NaN"


def make_scores(folder: Path) -> None:
    """A result and its answer."""
    write(folder / "results" / "case-000.json", RESULT)
    write(folder / "answers" / "case-000.json", ANSWER)


def read_scores(folder: Path) -> None:
    """Score them, and write the tables."""
    from bench.discrepancy import score_blind
    from bench.discrepancy.blind.score_report import markdown

    score = score_blind(folder / "results", folder / "answers")
    markdown(score)
    json.dumps(score.to_json(), allow_nan=False)


def make_protocol(folder: Path) -> None:
    """A case with a protocol."""
    write(folder / "protocol.json", {"exclude": ["gap"]})


def read_protocol(folder: Path) -> None:
    """Read a protocol."""
    from bench.discrepancy.blind.schema import ProtocolDocument

    ProtocolDocument.read(folder / "protocol.json")


TARGETS: dict[str, Target] = {
    "rig": Target(lambda folder: write(folder / "rig.json", RIG), spoiler("rig.json"), read_rig),
    "excitation": Target(
        lambda folder: write(
            folder / "rig.json",
            RIG
            | {
                "elements": RIG["elements"][:1],
                "timestep": 0.01,
                "excitation": None,
                "experiment": EXPERIMENT,
            },
        ),
        spoiler("rig.json"),
        read_request,
    ),
    "plan": Target(lambda folder: write(folder / "plan.json", PLAN), spoiler("plan.json"), read_plan),
    "nominal": Target(make_case, spoiler("nominal.json"), read_case),
    "manifest": Target(make_campaign, spoiler("campaign/manifest.json"), read_campaign),
    "policy": Target(make_policy, spoil_policy, read_policy),
    "plan_policy": Target(make_plans, spoil_policy, read_policy),
    "protocol": Target(make_protocol, spoiler("protocol.json"), read_protocol),
    "score": Target(make_scores, spoiler("results/case-000.json", "answers/case-000.json"), read_scores),
}
"""Targets by name."""
