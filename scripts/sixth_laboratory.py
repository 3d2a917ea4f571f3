"""Write the cases of a sixth laboratory, integrated apart from the bench, with small unmodelled physics in each.

    python scripts/sixth_laboratory.py out/sixth-laboratory
    python scripts/measured_cases.py sixth_ --cases out/sixth-laboratory

Of ten cases, two miss a stop or cogging, two a drag or a damping that differs each way, one relaxation, one a sensor that is coupled by AC,
and one friction beside a stiffness that is wrong; in one nothing of size is missing, and two miss what no catalogue holds. All have a
background besides. What is random follows from seeds of their author. ``README.md`` beside the cases tells what was simulated.
"""

from __future__ import annotations

import sys
from pathlib import Path

import tyro

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from laboratory_case_sets import SetArgs  # noqa: E402
from sixth_laboratory_cases.catalogue import CASES  # noqa: E402
from sixth_laboratory_cases.writing import write_acceptance, write_case  # noqa: E402


def main() -> int:
    """Write the cases, and last what is right of them."""
    args = tyro.cli(SetArgs, description=__doc__)
    for case in CASES:
        write_case(case, args.out / case.name)
        print(f"{case.name:18s} {case.why}", flush=True)
    write_acceptance(CASES, args.out)
    print(f"{len(CASES)} cases in {args.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
