"""Train a policy that shapes an excitation as it measures, and export it as plain arrays.

python scripts/train_excitation.py sdof
python scripts/train_excitation.py rivals --algorithm sac --steps 200000 --out out/sac

Stopped or killed, it goes on from its last checkpoint when called again.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from policies.progress import progress_bar

if TYPE_CHECKING:
    from envs.training import Score


@dataclass
class Args:
    """Train a policy.

    Attributes:
        task: sdof, joint, rivals (on the SDOF rig) or joint_rivals.
        algorithm: ppo or sac.
        steps: Windows in all.
        seconds: Most time to spend now.
        seed: Seed.
        n_envs: Benches side by side.
        memory: Units of a long short-term memory, by which the policy keeps the record; none by default (ppo only).
        start: pump (imitates a push along the velocity), design (corrects a D-optimal multisine), or nothing.
        reward: practice (merit at each rig itself), error (expected error at each rig), or prior or posterior (as the registered
            environments).
        learning_rate: Of Adam.
        discount: Of rewards, a window.
        out: Folder for checkpoint, curve and best policy; by default out/policies/TASK.
        fresh: Start anew where there is a checkpoint.
        export: File to write the best policy to (.npz).
        json: Print the curve, and the score of the policy that comes with the bench, as JSON.
    """

    task: tyro.conf.Positional[str] = "sdof"
    algorithm: str = "ppo"
    steps: int = 4_000_000
    seconds: float = math.inf
    seed: int = 0
    n_envs: int = 192
    memory: int = 0
    start: str = "pump"
    reward: str = "practice"
    learning_rate: float = 4e-4
    discount: float = 0.995
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    fresh: bool = False
    export: Path | None = None
    json: bool = False


def main() -> int:
    """Train, tell, export."""
    args = tyro.cli(Args, description=__doc__)
    from bench.errors import BenchError
    from bench.excitation import find_policy, policy_names
    from envs.training import Trainer, evaluate
    from envs.training_plan import TrainingPlan

    folder = args.out or Path("out/policies") / args.task
    try:
        plan = TrainingPlan(
            args.task, args.algorithm, args.steps, args.seed, args.n_envs,
            memory=args.memory, start=args.start, reward=args.reward, learning_rate=args.learning_rate, discount=args.discount,
        )  # fmt: skip
        with progress_bar(hidden=args.json) as bar:
            task = bar.add_task("starting", total=1.0)
            trainer = Trainer(plan, folder, resume=not args.fresh)
            policy = trainer.run(
                seconds=args.seconds,
                progress=lambda label, share: bar.update(task, description=label, completed=share),
            )
    except BenchError as error:
        print(f"train_excitation: {error}", file=sys.stderr)
        return 2
    if args.export is not None:
        policy.save(args.export)
    shipped = None
    if args.task in policy_names():
        known = find_policy(args.task)
        shipped = evaluate(known, args.task, n=plan.n_held_out, reward=plan.scored)._replace(
            steps=known.about["steps"], seconds=known.about["seconds"]
        )
    if args.json:
        curve = [row._asdict() for row in trainer.curve]
        print(json.dumps({"curve": curve, "shipped": shipped and shipped._asdict()}, indent=1))
        return 0
    for row in trainer.curve:
        print(_line(row))
    print(f"best policy: {args.export or folder / 'best.npz'}")
    if shipped is not None:
        print(f"the one that comes with the bench, on the same rigs:\n{_line(shipped)}")
    return 0


def _line(row: Score) -> str:
    return (
        f"{row.steps:>9} windows {row.seconds:6.0f} s: {row.merit:6.2f} nat, score {row.score:6.2f}, "
        f"violations {100 * row.violations:.2f} %, certain after {row.certain:.2f} s"
    )


if __name__ == "__main__":
    sys.exit(main())
