"""Write the cases of a third laboratory, integrated apart from the bench, with small unmodelled physics in each.

    python scripts/third_laboratory.py out/third-laboratory
    python scripts/measured_cases.py third_ --cases out/third-laboratory

Of 24 cases, six are of a joint under two loads, five of laws with a scheduling channel (which one does not follow), four of loggers
that fail, three of prescribed motions, two of forces that act at certain times; in two nothing of size is missing, and two miss what no
catalogue holds. All have a background besides. Units, channels, excitations and what is stated of the noise differ from case to case.
``README.md`` beside the cases tells what was simulated.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from laboratory_case_sets import SetArgs, write_end  # noqa: E402
from third_laboratory_cases.catalogue import CASES  # noqa: E402
from third_laboratory_cases.writing import Made, acceptance, in_words, overview, write_case  # noqa: E402


@dataclass(frozen=True)
class Args(SetArgs):
    """Write the cases, acceptance.json and README.md."""

    seed: int = 990317
    """Of the excitations, the nominal values, the noise and the faults."""


def main() -> int:
    """Write the cases, and last what is right of them."""
    args = tyro.cli(Args, description=__doc__)
    found: list[Made] = []
    for case in CASES:
        rng = case.generator(args.seed)
        one = Made(case, case.specimen.simulated(case, rng))
        write_case(one, args.out / case.name, rng)
        print(f"{case.name:34s} effect / background / left {in_words(one.simulated.sizes)}", flush=True)
        found.append(one)
    write_end(args.out, len(found), overview(found), acceptance(found))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
