"""What sets of robot cases by different authors share: how they are written, and how their dynamics are held against MuJoCo's.

Dynamics, friction, drives and sensors of every set are its author's own.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import mujoco
import numpy as np
import tyro

from bench.arrays import Array
from bench.errors import BenchError, UnknownNameError
from bench.files import write_text

_Case = TypeVar("_Case")
_Made = TypeVar("_Made")

RECORDS = ("identification", "identification_2", "validation")
"""Records of a case; the last one judges."""


class UnstableRobotError(BenchError, RuntimeError):
    """A simulated robot left the finite numbers."""


@dataclass(frozen=True)
class SetArgs:
    """Write the cases and their answers."""

    cases: tyro.conf.Positional[Path]
    """Folder for the cases."""
    answers: tyro.conf.Positional[Path]
    """Folder for the answers."""
    only: tuple[str, ...] = ()
    """Names of cases; all where none is given."""


@dataclass(frozen=True)
class SeededArgs(SetArgs):
    """Write the cases and their answers."""

    seed: int = 0
    """Added to the seed of each case; 0 gives the cases that README.md describes."""


def write_set(
    known: Mapping[str, _Case],
    *,
    only: Collection[str],
    rules: Path,
    cases: Path,
    write: Callable[[_Case], str],
) -> None:
    """Write the rules by which cases are graded, and one case after another.

    Args:
        known: Cases by name.
        only: Names of those that are written; all where none is given.
        rules: The acceptance.json of the set.
        cases: Folder for the cases.
        write: Writes a case and tells of it.

    Raises:
        SystemExit: No case has such a name; with the words for the user.
    """
    for name in only:
        if name not in known:
            raise SystemExit(str(UnknownNameError("case", name, known)))
    write_text(cases / "acceptance.json", rules.read_text(encoding="utf-8"))
    for name in only or known:
        print(f"{name}: {write(known[name])}", end="", flush=True)


def make_set(
    description: str | None,
    package: str,
    known: Mapping[str, _Case],
    *,
    make: Callable[[_Case, int], _Made],
    write: Callable[[_Made, Path, Path], None],
    told: Callable[[_Case, _Made], str],
) -> int:
    """The command of a set.

    Args:
        description: What `--help` says.
        package: Folder of its acceptance.json.
        known: Cases by name.
        make: Simulates a case, with a number that is added to its seed.
        write: Writes what was made into the folders for cases and for answers.
        told: What is printed of a case.

    Returns:
        The exit status.
    """
    args = tyro.cli(SeededArgs, description=description)

    def written(case: _Case) -> str:
        made = make(case, args.seed)
        write(made, args.cases, args.answers)
        return told(case, made)

    rules = Path(__file__).parent / package / "acceptance.json"
    write_set(known, only=args.only, rules=rules, cases=args.cases, write=written)
    return 0


def in_words(kind: str, difference: float, told: str) -> str:
    """What is printed of a case: its kind, how far its dynamics are from MuJoCo's, and what is told of its sizes."""
    return f"{kind}; mass matrix and bias differ from MuJoCo's by {difference:.1e}\n{told}"


def shown(row: Iterable[float | None]) -> str:
    """Numbers of a line, a dash where there is none."""
    return " ".join("-" if x is None else f"{x:.3g}" for x in row)


def differences_from_mujoco(
    mjcf: str, dynamics: Callable[[Array, Array], tuple[Array, Array]], *, states: int = 5
) -> float:
    """Largest difference of mass matrix [kg m^2 or kg] and bias [N m or N] from MuJoCo's, over random states.

    Args:
        mjcf: The model.
        dynamics: Positions and velocities (n) to mass matrix (n, n), rotors included, and bias (n).
        states: Number of states.
    """
    model = mujoco.MjModel.from_xml_string(mjcf)
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    worst = 0.0
    for _ in range(states):
        data.qpos[:], data.qvel[:] = rng.normal(size=model.nq), rng.normal(size=model.nv)
        mujoco.mj_forward(model, data)
        theirs = np.zeros((model.nv, model.nv))
        for j, unit in enumerate(np.eye(model.nv)):
            column = np.zeros(model.nv)
            mujoco.mj_mulM(model, data, column, unit)
            theirs[:, j] = column
        matrix, bias = dynamics(data.qpos.copy(), data.qvel.copy())
        worst = max(worst, float(np.abs(matrix - theirs).max()), float(np.abs(bias - data.qfrc_bias).max()))
    return worst
