"""Write the cases of a fourth laboratory, integrated apart from the bench, with small unmodelled physics in each.

    python scripts/fourth_laboratory.py out/fourth-laboratory
    python scripts/measured_cases.py fourth_ --cases out/fourth-laboratory

Of ten cases, three miss a stop or a drag, two have a sensor that is late or wrongly calibrated (one of them beside a spring that
stiffens), two miss friction; in one nothing of size is missing, and two miss what no catalogue holds. All have a background besides. Units,
channels, excitations, clocks and what is stated of the noise differ from case to case. ``README.md`` beside the cases tells what was
simulated.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from fourth_laboratory_cases.catalogue import CASES  # noqa: E402
from fourth_laboratory_cases.grading import Graded, acceptance  # noqa: E402
from fourth_laboratory_cases.sizing import sizes_of  # noqa: E402
from fourth_laboratory_cases.writing import in_words, overview, write_case  # noqa: E402
from laboratory_case_sets import SetArgs, write_end  # noqa: E402


@dataclass(frozen=True)
class Args(SetArgs):
    """Write the cases, acceptance.json and README.md."""

    seed: int = 20271105
    """Of the excitations, the nominal values, the clocks and the noise."""


def main() -> int:
    """Write the cases, and last what is right of them."""
    args = tyro.cli(Args, description=__doc__)
    found: list[Graded] = []
    for case in CASES:
        excited = case.excited(args.seed)
        write_case(case, excited, args.out / case.name, args.seed)
        found.append(Graded(case, sizes_of(case, excited[-1])))
        print(f"{case.name:24s} effect / background / left {in_words(found[-1].sizes)}", flush=True)
    write_end(args.out, len(found), overview(found), acceptance(found))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
