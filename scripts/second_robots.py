"""Write fourteen cases of robots, simulated apart from the bench and from MuJoCo, and the answers to them.

    python scripts/second_robots.py CASES ANSWERS
    python scripts/second_robots.py CASES ANSWERS --only gan-2 ptz-1
    python scripts/measured_cases.py ptz vee scar hop dsk gan --cases CASES

CASES gets one folder a case (`nominal.json`, `model.xml`, records), ANSWERS one JSON file a case, which the diagnosis must not see. The
robots are a pan-tilt head, a vertical arm of two links, a SCARA robot, a leg, a desktop arm and a gantry. Rigid-body dynamics, friction,
controllers and sensors are those of the package `second_robots_cases`. MuJoCo serves only to check mass matrices and bias forces of the
nominal models; the largest difference is printed. All cases take some minutes of one core.

Verdicts are graded by acceptance.json, the table in README.md of that package in the form that `measured_cases.py` reads. The answers are
not in the format of `jointbench blind score`: they describe noise and background in another way, and one case has two effects at each of
two joints.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from robot_case_sets import SetArgs, in_words, shown, write_set  # noqa: E402
from second_robots_cases.cases import RobotCase, robot_cases  # noqa: E402
from second_robots_cases.making import MadeRobotCase, make, write  # noqa: E402
from second_robots_cases.mjcf import against_mujoco  # noqa: E402


@dataclass(frozen=True)
class Args(SetArgs):
    """Write the cases and their answers."""

    seed: int = 990417
    """Of the deviations, the motions and the noise."""


def told(made: MadeRobotCase) -> str:
    """Sizes of the effects by joint, a line for each record."""
    lines = []
    for record, size in made.sizes.items():
        if size is not None:
            parts = (("gap", size.gap), ("background/main", size.background), ("main/noise", size.over_noise))
            lines.append(f"    {record}: {', '.join(f'{name} {shown(row)}' for name, row in parts if row)}\n")
    return "".join(lines)


def main() -> int:
    """Make the cases one after another."""
    args = tyro.cli(Args, description=__doc__)

    def written(case: RobotCase) -> str:
        made = make(case, args.seed)
        write(made, args.cases, args.answers)
        return in_words(case.kind, against_mujoco(case.robot), told(made))

    rules = Path(__file__).parent / "second_robots_cases" / "acceptance.json"
    write_set(robot_cases(), only=args.only, rules=rules, cases=args.cases, write=written)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
