"""Files of the cases: records, what is stated of them, and a table of what is in them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from third_laboratory_cases.writing import stated_noise, written

from bench.files import write_text
from fourth_laboratory_cases.case import WRITING, Case, Excited
from fourth_laboratory_cases.grading import Graded, why
from fourth_laboratory_cases.logger import logged, noise_levels
from fourth_laboratory_cases.sizing import Sizes, limit
from fourth_laboratory_cases.stating import drawn, stated

HEAD = """# Cases of the fourth laboratory

Written by `scripts/fourth_laboratory.py` from what was simulated, before anyone diagnosed. Sizes are NRMSE on the validation record, of the
response for which each is largest: *effect* of the missing effect alone, *background* of the small physics alone, *left* by the nominal
model at best within two stated standard deviations, without noise. *Limit* is the `nrmse` of acceptance.json. Right *unknown* stands for an
empty `right`.

| case | what was simulated | right | may stand beside | honest otherwise | wrong | noise | effect / background / left | limit |
|---|---|---|---|---|---|---|---|---|
"""


def write_case(case: Case, all_excited: Sequence[Excited], folder: Path, seed: int) -> None:
    """Write the folder of a case, from its excited records and the seed of nominal values, clocks and noise."""
    rng = case.generator(WRITING, seed)
    nominal = drawn(case, rng)
    records = {
        excited.record.stem: case.specimen.simulated(excited, effect=True, background=True)
        for excited in all_excited
    }
    levels = noise_levels(case, records)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "nominal.json", json.dumps(stated(case, nominal, levels), indent=1) + "\n")
    if case.model is not None:
        write_text(folder / case.rig, case.model(nominal))
    for stem, signals in records.items():
        write_text(folder / f"{stem}.csv", written(logged(case, stem, signals, levels, rng), value="%.7g"))


def in_words(sizes: Sizes) -> str:
    """Largest sizes of a case."""
    largest = [max(values) for values in zip(*sizes.values(), strict=True)]
    effect, background, _, left = largest
    return f"{effect:.3f} / {background:.4f} / {left:.3f}"


def overview(all_graded: Sequence[Graded]) -> str:
    """Content of `README.md`: what is in the cases."""
    rows = []
    for case, sizes in all_graded:
        right = " or ".join(" + ".join(group) or "none" for group in case.right) or "unknown"
        accepted = limit(case, sizes)
        cells = [
            case.name,
            why(case),
            right,
            ", ".join(case.also) or "–",
            "; ".join(case.honest),
            case.wrong,
            stated_noise(case.understated),
            in_words(sizes),
            "–" if accepted is None else f"{accepted:g}",
        ]
        rows.append(f"| {' | '.join(cells)} |\n")
    return HEAD + "".join(rows)
