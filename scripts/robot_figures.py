"""Figures of public records of robots, and what has to hold of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from capability_figures import Figures

from bench.discrepancy.articulated_effects.catalogue import effect
from bench.discrepancy.articulated_effects.effect import ArticulatedEffect
from bench.discrepancy.articulated_search.placements import AND

PUBLISHED_TX40 = {"joint_1": 7.14, "joint_2": 8.26, "joint_3": 6.34, "joint_4": 2.48}
"""Dry friction of the TX40 [N m] in the configuration of figaroh-plus's example."""


def _held(good: bool) -> str:
    return "holds" if good else "**misses**"


def _joints(row: Any, wanted: Callable[[ArticulatedEffect], bool]) -> set[str]:
    """Joints at which effects of a kind are named; both of those that share one."""
    named = [key[:-1].split(" (") for key in row["named"]]
    return {joint for name, where in named if wanted(effect(name)) for joint in where.split(AND)}


def _frictional(one: ArticulatedEffect) -> bool:
    return one.family == "friction"


def _ur10(row: Any) -> Figures:
    dry, damped = _joints(row, _frictional), _joints(row, lambda one: one.name == "damping_error")
    both = len(dry & damped)
    left = float(np.median([after for _, after, _ in row["joints"].values()]))
    n = len(row["joints"])
    return [
        (
            "UR10: joints with dry friction and viscous damping named",
            f"{both} of {n}",
            f"all {n}",
            _held(both == n),
        ),
        (
            "UR10: NRMSE of the effort on the record left out, median over the joints",
            f"{left:.3f}",
            "≤ 0.12",
            _held(left <= 0.12),
        ),
    ]


def _tx40(row: Any) -> Figures:
    off = {}
    for joint, published in PUBLISHED_TX40.items():
        told = row["parameters"].get(f"coulomb_friction ({joint})", {}).get("limit", 0.0)
        off[joint] = abs(told / published - 1.0)
    worst = max(off.values())
    coupled = any(key.startswith("coupled_friction (joint_5+joint_6)") for key in row["named"])
    return [
        (
            "TX40: Coulomb friction of joints 1 to 4 against what is published, the worst",
            f"{100.0 * worst:.0f} %",
            "≤ 15 %",
            _held(worst <= 0.15),
        ),
        (
            "TX40: the wrist whose joints share a motor",
            "found" if coupled else "not found",
            "found",
            _held(coupled),
        ),
    ]


def _so101(row: Any) -> Figures:
    after = {joint: [1e3 * pair[1] for pair in pairs] for joint, pairs in row["further"].items()}
    middle = float(np.median([np.median(x) for x in after.values()]))
    ninth = float(np.percentile(np.concatenate(list(after.values())), 90))
    n = len(next(iter(after.values())))
    return [
        (
            f"SO-101: RMS error over {n} whole motions that it was not learned from, median over the joints",
            f"{middle:.1f} mrad",
            "≤ 8 mrad",
            _held(middle <= 8.0),
        ),
        (
            "SO-101: the same, of joints and motions 90 % are below",
            f"{ninth:.1f} mrad",
            "≤ 15 mrad",
            _held(ninth <= 15.0),
        ),
    ]


def _both_joints(row: Any) -> Figures:
    joints = _joints(row, _frictional)
    gone = min(1.0 - after / before for before, after, _ in row["joints"].values())
    whole = min((1.0 - after / before for before, after in row["together"].values()), default=0.0)
    return [
        (
            f"{row['robot']}: joints with friction named",
            f"{len(joints)} of 2",
            "both",
            _held(len(joints) == 2),
        ),
        (
            f"{row['robot']}: part of the NRMSE of the unseen run that is gone, one joint free beside the other's motion, the lesser",
            f"{100.0 * gone:.0f} %",
            "≥ 50 %",
            _held(gone >= 0.5),
        ),
        (
            f"{row['robot']}: the same, both joints free at once",
            f"{100.0 * whole:.0f} %",
            "≥ 50 %",
            _held(whole >= 0.5),
        ),
    ]


LOADED = ("load_dependent_friction", "gear_friction")
"""Friction that grows with the torque carried."""


def _xl330(row: Any) -> Figures:
    loaded = bool(_joints(row, lambda one: one.name in LOADED))
    found = "preferred" if loaded else "not preferred"
    return [
        (
            "XL330: friction that grows with the torque carried, over Coulomb friction",
            found,
            "preferred",
            _held(loaded),
        )
    ]


def _backlash_bench(row: Any) -> Figures:
    """The dead zone: what friction makes of a servo's gain, or the clearance of a play, whichever is named."""
    counts = 4096.0 / (2.0 * np.pi)
    zones = []
    for key, values in row["parameters"].items():
        if _frictional(effect(key.split(" (")[0])):
            zones.append(
                2.0
                * values[next(name for name in ("limit", "limit_0") if name in values)]
                / row["nominal"]["kp:servo"]
            )
        elif "half_clearance" in values:
            zones.append(2.0 * values["half_clearance"])
    zone = counts * sum(zones)
    return [
        (
            "backlash bench: dead zone of the unloaded servo, published 7.03 counts",
            f"{zone:.2f} counts",
            "within 20 %",
            _held(abs(zone / 7.03 - 1.0) <= 0.2),
        )
    ]


ROBOT_LIMITS: dict[str, Callable[[Any], Figures]] = {
    "UR10": _ur10, "TX40": _tx40, "SO-101": _so101, "double pendulum A.0": _both_joints, "double pendulum C.1": _both_joints,
    "XL330": _xl330, "backlash bench": _backlash_bench,
}  # fmt: skip
"""What has to hold of some robots."""


def robots(told: Any) -> Figures:
    """Public records of robots."""
    rows = []
    for row in told:
        what = f"{row['robot']} ({row['known']}): NRMSE of the worst joint"
        if row["before"] is None:  # refused: the verdict says why
            rows.append((what, row["verdict"], ""))
            continue
        names = ", ".join(f"{name} {round(100.0 * share)} %" for name, share in row["named"].items())
        figure = f"{row['before']:.3g} → {row['after']:.3g}, noise {row['floor']:.3g}, {row['seconds']:.0f} s: {names or row['verdict']}"
        rows.append((what, figure, ""))
        rows += ROBOT_LIMITS[row["robot"]](row) if row["robot"] in ROBOT_LIMITS else []
    return rows
