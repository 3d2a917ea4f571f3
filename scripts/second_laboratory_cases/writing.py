"""Files of the cases: records with noise, what is stated of them, what is right of them, and a table of all of it."""

from __future__ import annotations

import gzip
import io
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

from bench.arrays import Array
from bench.files import write_bytes, write_text
from second_laboratory_cases.case import Case, Channel
from second_laboratory_cases.making import Made
from second_laboratory_cases.properties import Properties
from second_laboratory_cases.setups import Signals, System

HEAD = """# Cases of the second laboratory

Written by `scripts/second_laboratory.py` from what was simulated. NRMSE on all records without noise: *effect* is what the missing effect
makes of the response, *background* what the small physics besides makes of it, *left* what the nominal model leaves on the validation
record after a fit of its parameters within their stated uncertainty.

| case | physics, truth | right | honest otherwise | noise | effect / background / left |
|---|---|---|---|---|---|
"""
FOOT = """
Properties are those of `scripts/second_laboratory_cases/properties.py`, in SI units. *Right* is the `right` of acceptance.json; names of
its `also` are there in small size and may stand beside. Cases whose right is *unknown* have an empty `right`: a certain name of the
catalogue outside `also`, and *none*, are wrong.
"""


def noise(rng: np.random.Generator, n: int, std: float) -> Array:
    """Gaussian noise (n,): three quarters of its variance white, the rest coloured by a filter of first order."""
    if std == 0.0:
        return np.zeros(n)
    white = rng.standard_normal(n)
    settled = 200
    coloured = np.asarray(lfilter([1.0], [1.0, -0.85], rng.standard_normal(n + settled)))[settled:]
    coloured *= math.sqrt(1.0 - 0.85**2)
    return std * (math.sqrt(0.75) * white + 0.5 * coloured)


def noise_levels(made: Made) -> dict[str, float]:
    """Standard deviation of the noise of each channel, in SI units."""
    spread = {
        channel.signal: float(np.std(np.concatenate([each[channel.signal] for each in made.signals])))
        for channel in made.case.channels.values()
    }
    return {name: channel.noise * spread[channel.signal] for name, channel in made.case.channels.items()}


def stated(made: Made, levels: Mapping[str, float]) -> dict[str, Any]:
    """Content of `nominal.json`."""
    case = made.case

    def of_channel(channel: Channel, level: float) -> dict[str, Any]:
        told = {"unit": channel.unit, **channel.told}
        if case.understated is None:
            return told
        return {**told, "noise_std": float(f"{level * channel.scale / case.understated:.3g}")}

    parameters = {}
    for key, p in case.parameters.items():
        std = abs(p.true_value(case.truth)) * p.relative
        parameters[key] = {"value": made.nominal[key], "std": float(f"{std:.3g}"), "unit": p.unit}
    channels = {name: of_channel(channel, levels[name]) for name, channel in case.channels.items()}
    return {
        "rig": case.rig,
        "sample_rate_hz": float(case.rate),
        "parameters": parameters,
        "channels": channels,
        **case.told,
    }


def table(case: Case, signals: Signals, levels: Mapping[str, float], rng: np.random.Generator) -> str:
    """A record with noise, as a table of comma-separated values."""
    n = len(next(iter(signals.values())))
    columns = [np.arange(n) / case.rate]
    for name, channel in case.channels.items():
        columns.append((signals[channel.signal] + noise(rng, n, levels[name])) * channel.scale)
    text = io.StringIO()
    formats = ["%.9g", *("%.7g" for _ in case.channels)]
    np.savetxt(
        text, np.column_stack(columns), formats, ",", header=",".join(["time", *case.channels]), comments=""
    )
    return text.getvalue()


def write_case(made: Made, folder: Path, rng: np.random.Generator) -> None:
    """Write the folder of a case; the generator draws the noise."""
    case, levels = made.case, noise_levels(made)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "nominal.json", json.dumps(stated(made, levels), indent=1) + "\n")
    if case.model is not None:
        write_text(folder / case.rig, case.model(made.nominal))
    for record, signals in zip(case.records, made.signals, strict=True):
        text = table(case, signals, levels, rng)
        if case.compressed:
            write_bytes(folder / f"{record.stem}.csv.gz", gzip.compress(text.encode(), mtime=0))
        else:
            write_text(folder / f"{record.stem}.csv", text)


def limit(made: Made) -> float | None:
    """Largest error of a corrected model that is accepted; None where none is right."""
    case, sizes = made.case, made.sizes
    if not case.misses_something() or not case.right:
        return None
    if case.limit != "derived":
        return case.limit
    of_noise = next(c.noise for c in case.channels.values() if c.signal == case.setup.response)
    floor = max(0.3 * sizes.fitted, 2.0 * (sizes.background + of_noise))
    return round(min(0.6 * sizes.fitted, floor), 3)


def acceptance(all_made: Sequence[Made]) -> dict[str, Any]:
    """Content of `acceptance.json`."""
    entries = {
        made.case.name: {
            "right": [list(group) for group in made.case.right],
            "also": list(made.case.also),
            "nrmse": limit(made),
            "why": made.case.why,
        }
        for made in all_made
    }
    return {"written": "with the cases, from what was simulated", "cases": entries}


def truth(system: System) -> str:
    """Properties of a system that are not absent, and how its drive and transducer depart."""
    absent = Properties()._asdict()
    found = {key: value for key, value in system.properties._asdict().items() if value != absent[key]}
    if system.delay_samples:
        found["delay_samples"] = system.delay_samples
    if system.displacement_gain != 1.0:
        found["displacement_gain"] = system.displacement_gain
    return ", ".join(f"{key}={value:.4g}" for key, value in found.items())


def stated_noise(understated: float | None) -> str:
    """How the noise is stated, in words."""
    if understated is None:
        return "not stated"
    return "stated rightly" if understated == 1.0 else f"understated by {understated:g}"


def overview(all_made: Sequence[Made]) -> str:
    """Content of `README.md`: what is in the cases."""
    rows = []
    for made in all_made:
        case, sizes = made.case, made.sizes
        right = " or ".join(" + ".join(group) or "none" for group in case.right) or "unknown"
        of_noise = stated_noise(case.understated)
        of_sizes = f"{sizes.effect:.3f} / {sizes.background:.4f} / {sizes.fitted:.3f}"
        cells = (case.name, f"{case.why} `{truth(made.system)}`", right, case.honest, of_noise, of_sizes)
        rows.append(f"| {' | '.join(cells)} |\n")
    return HEAD + "".join(rows) + FOOT
