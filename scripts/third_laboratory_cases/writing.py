"""Files of the cases: records with noise, what is stated of them, what is right of them, and a table of all of it."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from bench.arrays import Array
from bench.files import write_text
from third_laboratory_cases.case import Case, Signals, Simulated, Sizes
from third_laboratory_cases.logger import Table

HEAD = """# Cases of the third laboratory

Written by `scripts/third_laboratory.py` from what was simulated, before anyone diagnosed. Sizes are NRMSE of the motion (of the force where
a machine prescribes the motion) on the validation record: *effect* of the missing effect alone, *background* of the small physics alone,
*left* by the nominal model after a fit within its stated uncertainties. *Limit* is the `nrmse` of acceptance.json. Right *unknown* stands
for an empty `right`.

| case | what was simulated | right | may stand beside | honest otherwise | noise | effect / background / left | limit |
|---|---|---|---|---|---|---|---|
"""


class Made(NamedTuple):
    """A case as it was made.

    Attributes:
        case: What describes it.
        simulated: Its records without noise, and its sizes.
    """

    case: Case
    simulated: Simulated


def noise(rng: np.random.Generator, n: int, std: float) -> Array:
    """Gaussian noise (n,): 81 % of its variance white, the rest coloured by a filter of first order."""
    settled = 100
    coloured = np.asarray(lfilter([0.8], [1.0, -0.6], rng.standard_normal(n + settled)))[settled:]
    return std * (0.9 * rng.standard_normal(n) + math.sqrt(1.0 - 0.81) * coloured)


def drawn(case: Case, rng: np.random.Generator) -> dict[str, float]:
    """Nominal values of the parameters, in SI units: off by their stated uncertainty, and by at most 1.3 of it."""
    truth = case.specimen.stated_values()
    return {
        name: truth[p.of] * (1.0 + p.relative * float(np.clip(rng.standard_normal(), -1.3, 1.3)))
        for name, p in case.parameters.items()
    }


def noise_levels(made: Made) -> dict[str, float]:
    """Standard deviation of the noise of each channel, in SI units."""
    case, signals = made.case, made.simulated.signals.values()
    return {
        name: channel.noise * float(np.std(np.concatenate([each[channel.signal] for each in signals])))
        for name, channel in case.channels.items()
    }


def stated(case: Case, nominal: Mapping[str, float], levels: Mapping[str, float]) -> dict[str, Any]:
    """Content of `nominal.json`."""
    truth = case.specimen.stated_values()
    parameters = {
        name: {
            "value": float(f"{nominal[name] * p.scale:.6g}"),
            "std": float(f"{truth[p.of] * p.relative * p.scale:.3g}"),
            "unit": p.unit,
        }
        for name, p in case.parameters.items()
    }
    channels: dict[str, dict[str, Any]] = {"time": {"unit": "s"}}
    for name, channel in case.channels.items():
        channels[name] = {"unit": channel.unit, **channel.told}
        if case.understated is not None:
            level = levels[name] * channel.scale / case.understated
            channels[name]["noise_std"] = float(f"{level:.3g}")
    return {
        "rig": case.rig,
        "sample_rate_hz": case.rate,
        "parameters": parameters,
        "channels": channels,
        **case.told,
    }


def logged(case: Case, signals: Signals, levels: Mapping[str, float], rng: np.random.Generator) -> Table:
    """A record as it is logged, with noise and with the faults of the logger."""
    columns = {}
    for name, channel in case.channels.items():
        clean = signals[channel.signal]
        columns[name] = (clean + noise(rng, len(clean), levels[name])) * channel.scale
    table = Table(np.arange(len(next(iter(columns.values())))) / case.rate, columns)
    for fault in case.faults:
        table = fault.logged(rng, table)
    return table


def written(table: Table, *, time: str = "%.7f", value: str = "%.8g") -> str:
    """A record as comma-separated values, in some formats."""
    text = io.StringIO()
    formats, header = [time, *(value for _ in table.columns)], ",".join(["time", *table.columns])
    values = np.column_stack([table.t, *table.columns.values()])
    np.savetxt(text, values, formats, ",", header=header, comments="")
    return text.getvalue()


def write_case(made: Made, folder: Path, rng: np.random.Generator) -> None:
    """Write the folder of a case; the generator draws nominal values, then noise and faults."""
    case = made.case
    nominal, levels = drawn(case, rng), noise_levels(made)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "nominal.json", json.dumps(stated(case, nominal, levels), indent=1) + "\n")
    if case.model is not None:
        write_text(folder / case.rig, case.model(nominal))
    for stem, signals in made.simulated.signals.items():
        write_text(folder / f"{stem}.csv", written(logged(case, signals, levels, rng)))


def limit(case: Case, sizes: Sizes) -> float | None:
    """Largest NRMSE of a corrected model that is accepted; None where none is right or nothing of size is missing."""
    if case.limit != "derived":
        return case.limit
    if sizes.left is None or not any(case.right):
        return None
    floor = 2.0 * (sizes.background + max(channel.noise for channel in case.channels.values()))
    return round(min(0.6 * sizes.left, max(0.3 * sizes.left, floor)), 3)


def acceptance(all_made: Sequence[Made]) -> dict[str, Any]:
    """Content of `acceptance.json`."""
    entries = {
        case.name: {
            "right": [list(group) for group in case.right],
            "also": list(case.also),
            "nrmse": limit(case, simulated.sizes),
            "why": case.why,
            "refusal": list(case.refusal),
        }
        for case, simulated in all_made
    }
    return {
        "written": "with the cases, from what was simulated, before any diagnosis",
        "cases": entries,
    }


def stated_noise(understated: float | None) -> str:
    """How the noise is stated, in words."""
    if understated is None:
        return "not stated"
    return "stated rightly" if understated == 1.0 else f"understated by {understated:g}"


def in_words(sizes: Sizes) -> str:
    """Sizes of a case, with a dash for what was not fitted."""
    left = "–" if sizes.left is None else f"{sizes.left:.3f}"
    return f"{sizes.effect:.3f} / {sizes.background:.4f} / {left}"


def overview(all_made: Sequence[Made]) -> str:
    """Content of `README.md`: what is in the cases."""
    rows = []
    for case, simulated in all_made:
        right = " or ".join(" + ".join(group) or "none" for group in case.right) or "unknown"
        of_noise, sizes = stated_noise(case.understated), in_words(simulated.sizes)
        accepted = limit(case, simulated.sizes)
        cells = [case.name, case.why, right, ", ".join(case.also), case.honest, of_noise, sizes]
        rows.append(f"| {' | '.join(cells)} | {'–' if accepted is None else accepted} |\n")
    return HEAD + "".join(rows)
