"""Write ten cases of robots by a third author, integrated apart from the bench and from MuJoCo, and the answers to them.

    python scripts/third_robots.py CASES ANSWERS
    python scripts/third_robots.py CASES ANSWERS --only boom-2 gantry-1
    python scripts/measured_cases.py boom gantry hung pal slide --cases CASES

The robots are a boom like an excavator's, a gantry with a wrist, a leg hung at its hip, a palletiser and a SCARA robot with a slide, two
cases each. CASES gets a folder for each case (`nominal.json`, `model.xml`, three records) and the acceptance.json by which
`measured_cases.py` grades; ANSWERS gets a JSON file for each case, which is kept from the diagnosis. Equations of motion, friction, drives
and sensors are those of the package `third_robots_cases`. MuJoCo only checks mass matrices and bias forces of the nominal models; the
largest difference is printed. All cases take about ten minutes of one core.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from robot_case_sets import in_words, make_set, shown  # noqa: E402
from third_robots_cases.cases import RobotCase, robot_cases  # noqa: E402
from third_robots_cases.making import MadeRobotCase, make, write  # noqa: E402
from third_robots_cases.mjcf import against_mujoco  # noqa: E402


def told(case: RobotCase, made: MadeRobotCase) -> str:
    """What is printed of a case: sizes of the effects by joint, a line for each record."""
    lines = []
    for record, size in made.sizes.items():
        parts = (("main", size.main), ("main/noise", size.main_over_noise), ("background", size.background))
        lines.append(f"    {record}: {', '.join(f'{name} {shown(row)}' for name, row in parts if row)}\n")
    return in_words(case.kind, against_mujoco(case.robot, case.drive), "".join(lines))


if __name__ == "__main__":
    raise SystemExit(
        make_set(__doc__, "third_robots_cases", robot_cases(), make=make, write=write, told=told)
    )
