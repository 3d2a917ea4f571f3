"""Vector environments against gymnasium's own over the single environments, 64 at a time."""

from __future__ import annotations

import gymnasium
import numpy as np

from benchmarks.timing import Row, interleave, ratio_row

N_ENVS = 64
STEPS = 40
IDS = ("JointBench/SDOFExcitation-v0", "JointBench/JointExcitation-v0", "JointBench/Discrimination-v0")
LIMITS = {"sync": "≥ 10", "async": "≥ 5"}


def rows(repeats: int = 15) -> list[Row]:
    """Rows of the group."""
    import envs  # noqa: F401  (registers the environments)

    return [row for identifier in IDS for row in _compare(identifier, repeats)]


def _compare(identifier: str, repeats: int) -> list[Row]:
    gymnasium.make(identifier).close()  # prior draws and compiled code are there before processes are forked
    peers = {
        mode: gymnasium.make_vec(identifier, num_envs=N_ENVS, vectorization_mode=mode, enforcement="cost")
        for mode in LIMITS
    }
    ours = gymnasium.make_vec(identifier, num_envs=N_ENVS, enforcement="cost")
    shape = (STEPS, N_ENVS, *(ours.single_action_space.shape or ()))
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, shape).astype(np.float32)

    def run(environments: gymnasium.vector.VectorEnv) -> None:
        for action in actions:
            environments.step(action)

    try:
        for environments in (ours, *peers.values()):
            environments.reset(seed=0)
        seconds = interleave(
            {"ours": lambda: run(ours), **{mode: (lambda p=peer: run(p)) for mode, peer in peers.items()}},
            repeats,
        )
    finally:
        for environments in (ours, *peers.values()):
            environments.close()
    steps = N_ENVS * STEPS
    return [
        ratio_row(
            f"{identifier.partition('/')[2]}, {N_ENVS} environments, {mode}",
            seconds["ours"],
            seconds[mode],
            limit=limit,
            meaning=f"environment steps a second, our vector environment / gymnasium's {mode} one over the single one",
            detail={
                "ours_steps_per_s": steps / float(np.median(seconds["ours"])),
                "peer_steps_per_s": steps / float(np.median(seconds[mode])),
            },
        )
        for mode, limit in LIMITS.items()
    ]
