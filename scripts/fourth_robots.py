"""Write nine cases of robots by a fourth author, integrated apart from the bench and from MuJoCo, and the answers to them.

    python scripts/fourth_robots.py CASES ANSWERS
    python scripts/fourth_robots.py CASES ANSWERS --only finger-2 stage-1
    python scripts/measured_cases.py finger crane wrist balanced stage ankle --cases CASES

The robots are a finger of a gripper, a camera crane on velocity servos, a wrist whose currents are measured, an arm balanced by springs, a
cart with a pendulum that nothing drives, and an ankle. CASES gets a folder for each case (`nominal.json`, `model.xml`, three records) and
the acceptance.json by which `measured_cases.py` grades; ANSWERS gets a JSON file for each case, which is kept from the diagnosis. Equations
of motion, friction, drives and sensors are those of the package `fourth_robots_cases`. MuJoCo only checks mass matrices and bias forces of
the nominal models; the largest difference is printed.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from fourth_robots_cases.answers import in_lines  # noqa: E402
from fourth_robots_cases.cases import RobotCase, robot_cases  # noqa: E402
from fourth_robots_cases.making import MadeRobotCase, make, write  # noqa: E402
from fourth_robots_cases.mjcf import against_mujoco  # noqa: E402
from robot_case_sets import in_words, make_set  # noqa: E402


def told(case: RobotCase, made: MadeRobotCase) -> str:
    """What is printed of a case."""
    return in_words(case.kind, against_mujoco(case.robot), in_lines(made.sizes))


if __name__ == "__main__":
    raise SystemExit(
        make_set(__doc__, "fourth_robots_cases", robot_cases(), make=make, write=write, told=told)
    )
