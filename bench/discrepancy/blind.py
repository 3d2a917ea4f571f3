"""The blind protocol: sealed cases, a diagnosis that never sees the answers, and the scoring.

`make_blind` writes cases into one folder and their answers into another; beside each case stands the SHA-256 of its answer,
so that nobody can change an answer afterwards, and the answer holds a random salt, so that nobody can guess it from
the hash. `run_blind` opens the cases only. `score_blind` opens both and checks the hashes.

The records are integrated with twenty steps a sample and set-valued friction, from laws drawn at random and scaled to a
wanted gap; noise is added last.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from scipy.signal import chirp

from bench.discrepancy.case import Case, CaseChannel, CaseRecord, NominalParameter, record_from_arrays
from bench.discrepancy.catalogue import CATALOGUE
from bench.discrepancy.diagnosis import diagnose_folder
from bench.discrepancy.effect import Effect
from bench.discrepancy.foreign import FOREIGN
from bench.discrepancy.problem import Array, Hypothesis, Placed, Problem
from bench.discrepancy.structure import structure_of
from bench.errors import FileFormatError, ParameterError

SUBSTEPS = 20
SENSORS = {
    "both": ("displacement", "acceleration"),
    "position": ("displacement",),
    "acceleration": ("acceleration",),
}
SIGNALS = ("random", "sweep", "multisine")
BISECTIONS = 12
"""Halvings of the logarithm of an amplitude in the search for a wanted gap: to about one percent."""


@dataclass(frozen=True)
class BlindOptions:
    """What sealed cases are drawn from.

    Attributes:
        gap: Smallest and largest wanted gap (NRMSE of the identification record).
        noise: Smallest and largest noise, as a part of the standard deviation of a channel.
        sensors: Keys of `SENSORS` to draw from.
        duration: Length of a record [s].
        sample_rate: [Hz].
        shares: Probabilities of none, single, double and foreign cases.
        effects: Names of effects to draw from; all of the catalogue's joint, actuator and sensor effects where empty.
    """

    gap: tuple[float, float] = (0.03, 0.6)
    noise: tuple[float, float] = (0.003, 0.03)
    sensors: tuple[str, ...] = ("both", "position", "acceleration")
    duration: float = 20.0
    sample_rate: float = 1000.0
    shares: tuple[float, float, float, float] = (0.2, 0.6, 0.1, 0.1)
    effects: tuple[str, ...] = ()


def make_blind(
    folder: str | Path,
    answers: str | Path,
    *,
    n: int,
    rng: np.random.Generator,
    options: BlindOptions | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> list[str]:
    """Make sealed sdof cases.

    Args:
        folder: Where the cases go, a folder each.
        answers: Where the answers go; another folder.
        n: Number of cases.
        rng: Source of all randomness.
        options: What to draw from.
        progress: Called with a line for every case.

    Returns:
        Names of the cases.

    Raises:
        ParameterError: The two folders are the same.
    """
    folder, answers = Path(folder), Path(answers)
    if folder.resolve() == answers.resolve():
        raise ParameterError(
            f"cases and answers would both go to '{folder}'; give the answers a folder of their own"
        )
    options = options or BlindOptions()
    answers.mkdir(parents=True, exist_ok=True)
    made = []
    for index in range(n):
        name = f"case-{index:03d}"
        case, answer = draw_case(name, rng, options)
        answer["salt"] = rng.bytes(16).hex()
        write_case(case, folder / name)
        text = json.dumps(answer, indent=1)
        (answers / f"{name}.json").write_text(text)
        (folder / name / "answer.sha256").write_text(hashlib.sha256(text.encode()).hexdigest() + "\n")
        progress(f"{name} made")
        made.append(name)
    return made


def draw_case(name: str, rng: np.random.Generator, options: BlindOptions) -> tuple[Case, dict]:
    """Draw one case and its answer."""
    kind = str(rng.choice(["none", "single", "double", "foreign"], p=options.shares))
    pool = [e for e in CATALOGUE if e.n_coordinates == 1 and e.site != "inertia" and e.log_prior > -1.5]
    if options.effects:
        pool = [e for e in CATALOGUE if e.name in options.effects]
    count = {"none": 0, "single": 1, "double": 2, "foreign": 0}[kind]
    chosen = [pool[int(i)] for i in rng.choice(len(pool), size=count, replace=False)]
    if kind == "foreign":
        chosen = [FOREIGN[int(rng.integers(len(FOREIGN)))]]
    commanded = any(e.site == "actuator" for e in chosen) or bool(rng.random() < 0.1)
    sensors = SENSORS["both" if any(e.site == "sensor" for e in chosen) else str(rng.choice(options.sensors))]
    mass = float(rng.uniform(2.0, 13.0))
    frequency = float(rng.uniform(2.0, 6.5))
    stiffness = mass * (2.0 * np.pi * frequency) ** 2
    damping = 2.0 * float(rng.uniform(0.02, 0.06)) * np.sqrt(mass * stiffness)
    truth = {"mass": mass, "stiffness": stiffness, "damping": damping}
    spread = {"mass": 0.01, "stiffness": 0.03, "damping": 0.2}
    nominal = tuple(
        NominalParameter(key, value * (1.0 + spread[key] * float(rng.standard_normal())), value * spread[key])
        for key, value in truth.items()
    )
    exact = tuple(NominalParameter(key, value, 0.0) for key, value in truth.items())
    channels = (
        CaseChannel("force", "N", "command" if commanded else "measured"),
        *(CaseChannel(s) for s in sensors),
    )
    loads = [_load(str(rng.choice(SIGNALS)), frequency, options, rng) for _ in range(2)]
    level = 0.01 * stiffness * float(rng.uniform(0.1, 0.4))
    time = np.arange(len(loads[0])) / options.sample_rate
    blank = dict.fromkeys(sensors, np.zeros(len(time)))
    records = tuple(
        record_from_arrays(label, time, {"force": level * load, **blank})
        for label, load in zip(("identification", "validation"), loads, strict=True)
    )
    bare = Case(name, "sdof", exact, channels, records[:1], records[1:])
    hypothesis, etas, clean = _scaled(bare, chosen, rng, options)
    noise = float(np.exp(rng.uniform(*np.log(options.noise))))
    stds = {s: noise * float(np.std(clean[0][s])) for s in sensors}
    stds["force"] = 0.0 if commanded else noise * float(np.std(records[0].values["force"]))
    noisy = []
    for record, response in zip(records, clean, strict=True):
        values = {"force": record.values["force"], **response}
        noisy.append(
            record_from_arrays(
                record.name, time, {k: v + stds[k] * rng.standard_normal(len(v)) for k, v in values.items()}
            )
        )
    final = tuple(CaseChannel(c.name, c.unit, c.role, stds[c.name]) for c in channels)
    case = Case(name, "sdof", nominal, final, (noisy[0],), (noisy[1],))
    scaler = Problem(bare, structure_of(bare), tuple(_filled(records[0], clean[0]) for _ in range(1)))
    effects = [
        {
            "name": p.effect.name,
            "parameters": [float(x) for x in p.effect.values(eta, scaler.scales(p.place))],
        }
        for p, eta in zip(hypothesis, etas, strict=True)
    ]
    return case, {"class": kind, "effects": effects, "noise": noise, "true": truth, "sensors": list(sensors)}


def _filled(record: CaseRecord, response: dict[str, Array]) -> CaseRecord:
    return CaseRecord(record.name, record.step, record.start, {**record.values, **response})


def _scaled(
    bare: Case, chosen: Sequence[Effect], rng: np.random.Generator, options: BlindOptions
) -> tuple[Hypothesis, list[Array], list[dict[str, Array]]]:
    """Draw the effects' shapes, and scale their amplitude to the wanted gap; return clean responses of both records."""
    structure = structure_of(bare)
    base = _problem(bare, structure)
    reference = base.simulate((), np.zeros(3), bare.identification[0])
    # the scales of the effects come from the motion, so the linear motion is handed to the problem as if measured
    filled = _filled(bare.identification[0], dict(zip(structure.channels, reference.T, strict=True)))
    problem = _problem(
        Case(bare.name, bare.rig, bare.parameters, bare.channels, (filled,), bare.validation), structure
    )
    place = structure.places[0]
    targets = {"actuator": "force", "sensor": "displacement", "joint": ""}
    hypothesis = tuple(
        Placed(e, place, "acceleration" if e.quantity == "acceleration" else targets[e.site]) for e in chosen
    )
    shapes = [_draw_shape(e, rng) for e in chosen]
    wanted = float(np.exp(rng.uniform(*np.log(options.gap))))
    low, high = -9.0, 2.5
    etas = shapes
    for _ in range(BISECTIONS if chosen else 0):
        middle = 0.5 * (low + high)
        etas = [_with_amplitude(e, shape, middle) for e, shape in zip(chosen, shapes, strict=True)]
        response = problem.simulate(hypothesis, np.concatenate([np.zeros(3), *etas]), filled)
        gap = np.sqrt(np.mean((response - reference) ** 2, axis=0) / np.var(reference, axis=0)).max()
        low, high = (middle, high) if gap < wanted else (low, middle)
    vector = np.concatenate([np.zeros(3), *etas])
    responses = [
        problem.simulate(hypothesis, vector, record) for record in (*bare.identification, *bare.validation)
    ]
    return hypothesis, etas, [dict(zip(structure.channels, r.T, strict=True)) for r in responses]


def _problem(case: Case, structure) -> Problem:
    return Problem(case, structure, case.identification, substeps=SUBSTEPS)


def _draw_shape(effect: Effect, rng: np.random.Generator) -> Array:
    eta = np.array([rng.normal(p.mean, 0.5 * p.std) for p in effect.parameters])
    for i, p in enumerate(effect.parameters):
        if p.fixed:
            eta[i] = rng.choice(p.grid)
    if effect.parameters[0].signed:
        eta[0] = rng.choice([-1.0, 1.0])
    return np.clip(eta, [p.bounds[0] for p in effect.parameters], [p.bounds[1] for p in effect.parameters])


def _with_amplitude(effect: Effect, shape: Array, log_amplitude: float) -> Array:
    eta = shape.copy()
    eta[0] = np.sign(shape[0]) * np.exp(log_amplitude) if effect.parameters[0].signed else log_amplitude
    return np.clip(eta, [p.bounds[0] for p in effect.parameters], [p.bounds[1] for p in effect.parameters])


def _load(kind: str, frequency: float, options: BlindOptions, rng: np.random.Generator) -> Array:
    """Unit-RMS load around the resonance."""
    n = round(options.duration * options.sample_rate)
    t = np.arange(n) / options.sample_rate
    if kind == "sweep":
        load = chirp(t, 0.3 * frequency, options.duration, 2.5 * frequency)
    else:
        f = np.fft.rfftfreq(n, 1.0 / options.sample_rate)
        inside = (f > 0.2 * frequency) & (f < 2.7 * frequency)
        amplitude = np.ones(len(f)) if kind == "multisine" else np.abs(rng.standard_normal(len(f)))
        load = np.fft.irfft(np.where(inside, amplitude * np.exp(2j * np.pi * rng.random(len(f))), 0.0), n)
    load = load * np.minimum(t / 0.2, 1.0)
    return load / np.sqrt(np.mean(load**2))


def write_case(case: Case, folder: str | Path) -> None:
    """Write a case as a folder that `read_case` reads."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    nominal = {
        "rig": case.rig,
        "sample_rate_hz": 1.0 / case.identification[0].step,
        "parameters": {p.name: {"value": p.value, "std": p.std, "unit": p.unit} for p in case.parameters},
        "channels": {
            "time": {"unit": "s"},
            **{c.name: {"unit": c.unit, "role": c.role, "noise_std": c.noise_std} for c in case.channels},
        },
    }
    (folder / "nominal.json").write_text(json.dumps(nominal, indent=1))
    for record in (*case.identification, *case.validation):
        table = np.column_stack([record.time, *record.values.values()])
        header = ",".join(["time", *record.values])
        np.savetxt(
            folder / f"{record.name}.csv.gz", table, delimiter=",", header=header, comments="", fmt="%.8g"
        )


def run_blind(
    folder: str | Path, results: str | Path, *, progress: Callable[[str], None] = lambda text: None, **options
) -> list[Path]:
    """Diagnose every case of a folder and write one JSON file each; answers are never opened.

    Args:
        folder: Folder of case folders.
        results: Where the JSON files go.
        progress: Called with a line for every case.
        **options: Passed to `diagnose`.
    """
    folder, results = Path(folder), Path(results)
    cases = sorted(path.parent for path in folder.glob("*/nominal.json"))
    if not cases:
        raise FileFormatError(f"no case folder (one with nominal.json) in '{folder}'")
    results.mkdir(parents=True, exist_ok=True)
    written = []
    for path in cases:
        verdict = diagnose_folder(path, **options).verdict
        target = results / f"{path.name}.json"
        target.write_text(json.dumps(verdict.to_json(), indent=1))
        progress(f"{path.name}: {verdict.explanation} ({verdict.seconds:.1f} s)")
        written.append(target)
    return written


FAMILIES = {e.name: e.family for e in CATALOGUE}


@dataclass(frozen=True)
class BlindScore:
    """Scores of a blind run; shares are NaN where no case of the kind exists.

    Attributes:
        n: Number of cases scored.
        exact: Share of single-effect cases named exactly, or with the truth in a declared indistinguishable set.
        family: Share of single-effect cases with the right family.
        place: Share of named joint-rig effects with the right axis.
        false_alarms: Share of clean cases with another verdict than "none".
        unknown_caught: Share of foreign cases with the verdict "unknown".
        both_named: Share of double cases with both effects named.
        calibration_error: Expected calibration error of the named effects' probabilities, in ten bins.
        median_ratio: Median of after / noise_floor over cases.
        p90_ratio: Its 90th percentile.
        confusion: True name to named name to count, single-effect cases.
        wrong: One line for every case that is not right.
    """

    n: int
    exact: float
    family: float
    place: float
    false_alarms: float
    unknown_caught: float
    both_named: float
    calibration_error: float
    median_ratio: float
    p90_ratio: float
    confusion: dict[str, dict[str, int]] = field(default_factory=dict)
    wrong: tuple[str, ...] = ()

    def to_json(self) -> dict:
        """Return the score as JSON values."""
        return {k: (None if isinstance(v, float) and np.isnan(v) else v) for k, v in asdict(self).items()}
