"""Write the cases of a second laboratory, integrated apart from the bench, with small unmodelled physics in each.

    python scripts/second_laboratory.py out/second-laboratory
    python scripts/measured_cases.py second_ --cases out/second-laboratory

Of 24 cases, 14 miss one effect of size, four miss two, and in three nothing of size is missing; three miss what no catalogue holds. All
have a background besides: a hidden resonator, friction along the stroke, a slow swing of the stiffness or some relaxation. Test
set-ups, units, channels, excitations and what is stated of the noise differ from case to case. ``README.md`` beside the cases tells
what was simulated.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from laboratory_case_sets import SetArgs, write_end  # noqa: E402
from second_laboratory_cases.catalogue import CASES  # noqa: E402
from second_laboratory_cases.making import Made, made  # noqa: E402
from second_laboratory_cases.writing import acceptance, overview, write_case  # noqa: E402


@dataclass(frozen=True)
class Args(SetArgs):
    """Write the cases, acceptance.json and README.md."""

    seed: int = 77120
    """Of the excitations, the nominal values and the noise."""


def main() -> int:
    """Write the cases, and last what is right of them."""
    args = tyro.cli(Args, description=__doc__)
    found: list[Made] = []
    for case in CASES:
        rng = np.random.default_rng([args.seed, case.number])
        one = made(case, rng)
        write_case(one, args.out / case.name, rng)
        sizes = one.sizes
        print(
            f"{case.name:26s} effect {sizes.effect:.3f}, background {sizes.background:.4f}, "
            f"left by the nominal model {sizes.unfitted:.3f}, by the fitted one {sizes.fitted:.3f}",
            flush=True,
        )
        found.append(one)
    write_end(args.out, len(found), overview(found), acceptance(found))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
