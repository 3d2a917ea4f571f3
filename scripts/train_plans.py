"""Train a policy that chooses among plans made for drawn rigs, by the record so far, and export it as plain arrays.

python scripts/train_plans.py sdof
python scripts/train_plans.py joint --plans 320 --export joint.npz

Stopped or killed, it goes on after the last decision whose plans were tried.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from policies.progress import progress_bar


@dataclass
class Args:
    """Train a policy of plans.

    Attributes:
        task: sdof or joint.
        decisions: Times of decisions, as shares of the test.
        plans: Plans that each decision is among.
        rigs: Rigs of each hypothesis on which plans are tried.
        tried: Plans that are tried on each.
        backgrounds: Share of the rigs that have a background.
        steps: Steps of the network's training, for each decision.
        seed: Seed.
        out: Folder for what is done so far and the policy; by default out/policies/TASK-plans.
        fresh: Start anew where there is something.
        export: File to write the policy to (.npz).
        json: Print the score on held-out rigs as JSON.
    """

    task: tyro.conf.Positional[str] = "sdof"
    decisions: tuple[float, ...] = (0.2, 0.4)
    plans: int = 240
    rigs: int = 5000
    tried: int = 40
    backgrounds: float = 0.0
    steps: int = 6000
    seed: int = 0
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    fresh: bool = False
    export: Path | None = None
    json: bool = False


def main() -> int:
    """Train, tell, export."""
    args = tyro.cli(Args, description=__doc__)
    from bench.errors import BenchError
    from envs.plan_training import train_plans
    from envs.training import evaluate
    from envs.training_plan import PlanTraining

    folder = args.out or Path("out/policies") / f"{args.task}-plans"
    try:
        training = PlanTraining(
            args.task,
            args.decisions,
            args.plans,
            args.rigs,
            args.tried,
            args.backgrounds,
            steps=args.steps,
            seed=args.seed,
        )
        with progress_bar(hidden=args.json) as bar:
            task = bar.add_task("starting", total=1.0)
            policy = train_plans(
                training,
                folder,
                lambda label, share: bar.update(task, description=label, completed=share),
                resume=not args.fresh,
            )
        if args.export is not None:
            policy.save(args.export)
        score = evaluate(policy, args.task)
    except BenchError as error:
        print(f"train_plans: {error}", file=sys.stderr)
        return 2
    if args.json:
        print(json.dumps({"score": score._replace(seconds=policy.about["seconds"])._asdict()}, indent=1))
        return 0
    print(
        f"{policy.about['seconds']:.0f} s: score {score.score:.2f} nat, violations {100 * score.violations:.2f} %; "
        f"policy: {args.export or folder / 'best.npz'}"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
