"""Write nine cases of robots by a sixth author, integrated apart from the bench and from MuJoCo, and the answers to them.

    python scripts/sixth_robots.py CASES ANSWERS
    python scripts/sixth_robots.py CASES ANSWERS --only sixth_desk_1 sixth_crane_2
    python scripts/measured_cases.py sixth_ --cases CASES

The robots are a SCARA arm, a leg of a quadruped, an arm for a desk on hobby servos, a crane for a camera, a head that picks and places, a
model of a digger and a leg with a wheel. CASES gets a folder for each case (`nominal.json`, the model of the robot, four records) and the
acceptance.json by which `measured_cases.py` grades; ANSWERS gets a JSON file for each case, which is kept from the diagnosis. Equations of
motion, drives and sensors are those of the package `sixth_robots_cases`. MuJoCo only checks mass matrices and bias forces of the nominal
models; the largest difference is printed.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from robot_case_sets import in_words, make_set  # noqa: E402
from sixth_robots_cases.answers import in_lines  # noqa: E402
from sixth_robots_cases.cases import RobotCase, robot_cases  # noqa: E402
from sixth_robots_cases.making import MadeRobotCase, make, write  # noqa: E402
from sixth_robots_cases.mjcf import against_mujoco  # noqa: E402


def told(case: RobotCase, made: MadeRobotCase) -> str:
    """What is printed of a case."""
    return in_words(case.kind, against_mujoco(case.robot), in_lines(made.sizes))


if __name__ == "__main__":
    raise SystemExit(
        make_set(__doc__, "sixth_robots_cases", robot_cases(), make=make, write=write, told=told)
    )
