"""Experiments with excitation policies, each by one command.

    python scripts/policy_experiment.py rewards sdof --json out/rewards.json --figure out/rewards.svg
    python scripts/policy_experiment.py train sdof --rewards practice error --json out/train.json
    python scripts/policy_experiment.py backgrounds sdof
    python scripts/policy_experiment.py targets examples/arm/arm.xml -o targets.csv

`rewards` runs some 200 records of drawn rigs under many excitations, without and with a background, identifies each, and tells how
well each reward ranks the error that is left: Spearman's rank correlation, 1 where the reward follows identification. `train` trains
policies for different rewards, without and with a memory of the record, and holds them against the planner and open-loop designs on
held-out rigs. `backgrounds` does the latter with policies that are there. Stopped, either goes on by the same command. `targets` designs
joint targets for a model of your own.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent))

from bench.errors import BenchError
from bench.files import write_text
from envs.setups import Setup, joint_setup, sdof_setup

SETUPS = {"sdof": sdof_setup, "joint": joint_setup}


@dataclass
class Rewards:
    """Rank identification error by rewards.

    Attributes:
        task: sdof or joint.
        records: Records at least, each of rigs without and with a background.
        seed: Seed of rigs, noise and searches.
        json: File for the figures; "-" prints them.
        rows: File for what was measured of each record (JSON).
        figure: File for a figure (.svg, .png or .pdf).
    """

    task: tyro.conf.Positional[str] = "sdof"
    records: int = 200
    seed: int = 0
    json: Path | None = None
    rows: Path | None = None
    figure: Path | None = None

    def __call__(self) -> None:
        """Run the study."""
        from policies.figure import rewards_figure
        from policies.rewards import REWARDS, ranking, study

        console = Console(stderr=True)
        with console.status("") as status:
            rows = study(
                setup_of(self.task), self.task, records=self.records, seed=self.seed, tell=status.update
            )
        numbers: dict[str, Any] = {"task": self.task, "seed": self.seed, "rewards": REWARDS, **ranking(rows)}
        if self.rows is not None:
            write_text(self.rows, json.dumps(rows))
        if self.figure is not None:
            rewards_figure(rows, self.figure)
        if _written(numbers, self.json):
            return
        for where in ("without background", "with background", "both"):
            _tell_rewards(
                f"{self.task}, rigs {where}" if where != "both" else f"{self.task}, all rigs", numbers[where]
            )


@dataclass
class Train:
    """Train policies for different rewards, without and with a memory, and hold them against the planner and open-loop designs.

    Attributes:
        task: sdof or joint.
        rewards: Rewards: practice, error, prior or posterior, see scripts/train_excitation.py.
        memories: Units of a memory of the record, 0 for none.
        seeds: Seeds of training, for each reward and memory.
        steps: Windows of each training.
        rig_seeds: Seeds of held-out rigs.
        rigs: Held-out rigs a seed, each without and with a background.
        out: Folder of checkpoints.
        json: File for the figures; "-" prints them.
        figure: File for a figure (.svg, .png or .pdf).
    """

    task: tyro.conf.Positional[str] = "sdof"
    rewards: tuple[str, ...] = ("practice", "error")
    memories: tuple[int, ...] = (0, 64)
    seeds: int = 3
    steps: int = 4_000_000
    rig_seeds: int = 10
    rigs: int = 50
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("out/policy_experiment")
    json: Path | None = None
    figure: Path | None = None

    def __call__(self) -> None:
        """Train and compare."""
        from policies.contest import contest, summary, trained
        from policies.figure import contest_figure

        setup = setup_of(self.task)
        with Console(stderr=True).status("") as status:
            policies = trained(
                self.task, self.rewards, self.memories, self.seeds, self.steps, self.out, status.update
            )
            rows = contest(
                setup, policies, seeds=self.rig_seeds, rigs=self.rigs, folder=self.out, tell=status.update
            )
        numbers: dict[str, Any] = {"task": self.task, "steps": self.steps, **summary(rows)}
        if self.figure is not None:
            contest_figure(numbers, self.figure)
        _tell_all(numbers, self.json)


@dataclass
class Backgrounds:
    """Hold trained policies against the planner and open-loop designs on held-out rigs without and with a background.

    Attributes:
        task: sdof or joint.
        policies: Policies by name or file; by default the one that comes with the task.
        planner: Also the planner.
        rig_seeds: Seeds of held-out rigs.
        rigs: Held-out rigs a seed, each without and with a background.
        out: Folder of what is done so far; stopped, the same command goes on.
        json: File for the figures; "-" prints them.
        figure: File for a figure (.svg, .png or .pdf).
    """

    task: tyro.conf.Positional[str] = "sdof"
    policies: tuple[str, ...] = ()
    planner: bool = True
    rig_seeds: int = 10
    rigs: int = 50
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("out/policy_experiment")
    json: Path | None = None
    figure: Path | None = None

    def __call__(self) -> None:
        """Compare."""
        from policies.contest import contest, summary
        from policies.figure import contest_figure

        from bench.excitation import find_policy

        setup = setup_of(self.task)
        policies = {f"policy {Path(name).stem}": find_policy(name) for name in self.policies or (self.task,)}
        with Console(stderr=True).status("") as status:
            rows = contest(
                setup,
                policies,
                seeds=self.rig_seeds,
                rigs=self.rigs,
                planner=self.planner,
                folder=self.out,
                tell=status.update,
            )
        numbers: dict[str, Any] = {"task": self.task, **summary(rows)}
        if self.figure is not None:
            contest_figure(numbers, self.figure)
        _tell_all(numbers, self.json)


@dataclass
class Targets:
    """Design joint targets from which friction, damping and inertia of an arm of your own can be told, as CSV.

    Attributes:
        model: MJCF of hinges and slides with a servo or motor each.
        out: The file (.csv).
        duration: Of the test [s].
        velocity: Largest velocity of every joint [rad/s or m/s]; by default its range within a second.
        torque: Largest torque of every joint [N m or N]; by default the drive's own.
        seed: Seed of drawn arms and candidates.
        json: Print JSON.
    """

    model: tyro.conf.Positional[Path]
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("targets.csv")
    duration: float = 10.0
    velocity: float | None = None
    torque: float | None = None
    seed: int = 0
    json: bool = False

    def __call__(self) -> None:
        """Design and write."""
        from envs.arm_design import design_targets
        from envs.arms import ArmArguments, arm_setup

        plain = arm_setup(ArmArguments(str(self.model), {}, {}, {}, {}))
        names = [axis.joint.name for axis in plain.axes]
        limits = [dict.fromkeys(names, value) if value else {} for value in (self.velocity, self.torque)]
        setup = replace(arm_setup(ArmArguments(str(self.model), {}, {}, *limits)), duration=self.duration)
        with Console(stderr=True).status("") as status:
            made = design_targets(
                setup,
                seed=self.seed,
                tell=lambda i, error: status.update(f"candidate {i}: error {error:.3g}"),
            )
        made.write(self.out)
        told = {
            "file": str(self.out), "unknown": list(setup.hypothesis.names), "expected_error": made.error,
            "reached_range": made.reached[0], "reached_velocity_or_torque": made.reached[1],
        }  # fmt: skip
        if self.json:
            print(json.dumps(told))
            return
        print(
            f"{self.out}: expected error {made.error:.3g} prior standard deviations of {', '.join(told['unknown'])}; "
            f"{100.0 * made.reached[0]:.0f} % of the ranges, {100.0 * made.reached[1]:.0f} % of velocities and torques reached"
        )


def setup_of(task: str) -> Setup:
    """The laboratory of a task.

    Raises:
        BenchError: There is no such task.
    """
    if task not in SETUPS:
        raise BenchError(f"no task '{task}'; known: {', '.join(SETUPS)}")
    return SETUPS[task]()


def _written(numbers: dict[str, Any], path: Path | None) -> bool:
    """Write the figures; whether they were printed."""
    text = json.dumps(numbers, indent=1)
    if path == Path("-"):
        print(text)
        return True
    if path is not None:
        write_text(path, text)
    return False


def _tell_rewards(title: str, rows: dict[str, Any]) -> None:
    table = Table("reward", "Spearman", "95 %", "one measurement", "within a rig", "by kind", title=title)
    for name, row in rows.items():
        low, high = row["interval"]
        table.add_row(
            name,
            f"{row['spearman']:.2f}",
            f"{low:.2f} … {high:.2f}",
            f"{row['one measurement']:.2f}",
            f"{row['within a rig']:.2f}",
            ", ".join(f"{kind} {value:.2f}" for kind, value in row["by kind"].items()),
        )
    Console(width=140).print(table)


def _tell_all(numbers: dict[str, Any], path: Path | None) -> None:
    if _written(numbers, path):
        return
    for where in ("without background", "with background"):
        for kind, group in numbers[where].items():
            _tell_contest(f"{numbers['task']}, {kind}, rigs {where}", group)


def _tell_contest(title: str, rows: dict[str, Any]) -> None:
    table = Table("method", "error", "95 %", "of the best open-loop", "violations %", title=title)
    for name, row in rows.items():
        (low, high), (least, most) = row["interval"], row["ratio_interval"]
        table.add_row(
            name,
            f"{row['error']:.3g}",
            f"{low:.3g} … {high:.3g}",
            f"{row['ratio']:.2f} ({least:.2f} … {most:.2f}) of {row['best_open_loop']}",
            f"{row['violations_percent']:.2f}",
        )
    Console(width=120).print(table)


def main() -> int:
    """Run one of the experiments."""
    command = tyro.extras.subcommand_cli_from_dict(
        {"rewards": Rewards, "train": Train, "backgrounds": Backgrounds, "targets": Targets},
        description=__doc__,
    )
    try:
        command()
    except BenchError as error:
        print(f"policy_experiment: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
