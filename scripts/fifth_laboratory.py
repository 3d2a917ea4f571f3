"""Write the cases of a fifth laboratory, integrated apart from the bench, with small unmodelled physics in each.

    python scripts/fifth_laboratory.py out/fifth-laboratory
    python scripts/measured_cases.py fifth_ --cases out/fifth-laboratory

Of ten cases, two have a drive or a sensor that is late, two a friction or a damping with a stop that is missing, two a suspension that
relaxes or warms up, and one a disc that is heavier than stated; in one nothing of size is missing, and two miss what no catalogue holds.
All have a background besides. What is random follows from seeds of their author. ``README.md`` beside the cases tells what was simulated.
"""

from __future__ import annotations

import sys
from pathlib import Path

import tyro

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from fifth_laboratory_cases.catalogue import CASES  # noqa: E402
from fifth_laboratory_cases.grading import acceptance  # noqa: E402
from fifth_laboratory_cases.sizing import sizes_of  # noqa: E402
from fifth_laboratory_cases.writing import in_words, overview, write_case  # noqa: E402
from laboratory_case_sets import SetArgs, write_end  # noqa: E402


def main() -> int:
    """Write the cases, and last what is right of them."""
    args = tyro.cli(SetArgs, description=__doc__)
    sizes = []
    for case in CASES:
        write_case(case, args.out / case.name)
        sizes.append(sizes_of(case))
        print(f"{case.name:18s} effect, background, noise: {', '.join(in_words(sizes[-1]))}", flush=True)
    write_end(args.out, len(CASES), overview(CASES, sizes), acceptance(CASES))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
