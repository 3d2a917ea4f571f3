"""The ends of a tree of bodies in the records of a problem: which joints raise them, how high they are, what their parameters scale by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bench.discrepancy.articulated_effects.effect import JointScales
from bench.discrepancy.articulated_search.problem import ArticulatedProblem


@dataclass(frozen=True)
class EndSettings:
    """Numbers of `bench.discrepancy.articulated_search.ends`."""

    rise: float = 1e-3
    """Difference of heights [m] that an end has to go through: what is known of the shape of a body is hardly better."""
    lever: float = 1e-9
    """Lever [m] up to which a joint raises nothing: rounding."""


END_SETTINGS = EndSettings()


@dataclass(frozen=True)
class End:
    """An end of the tree.

    Attributes:
        body: Name of the body.
        joint: Index of the joint that moves it.
        others: Indices of further joints that raise it.
        scales: Of its lowest point: the force that would take the RMS torque of the joints that raise it, the difference of its heights
            (`position`), its largest speed, and the lowest height (`middle`).
    """

    body: str
    joint: int
    others: tuple[int, ...]
    scales: JointScales


def ends_within(problem: ArticulatedProblem) -> list[End]:
    """The ends of the tree of a problem that rise and sink in its records; where a single joint raises one, a surface is a stop of that."""
    bodies = [joint.body for joint in problem.joints]
    out = []
    for body in problem.records[0].joints[0].touches:
        points = [
            np.concatenate([record.joints[j].touches[body] for record in problem.records], axis=1)
            for j in range(len(bodies))
        ]
        heights = points[0][0]
        rates = [np.gradient(r.joints[0].touches[body][0], r.joints[0].step) for r in problem.records]
        levers = np.array([np.sqrt(np.mean(point[1] ** 2)) for point in points])
        rise, joint = float(np.ptp(heights)), bodies.index(body) if body in bodies else -1
        if rise < END_SETTINGS.rise or joint < 0:
            continue
        raising = [j for j in range(len(bodies)) if levers[j] > END_SETTINGS.lever]
        if len(raising) < 2:
            continue
        torque = float(np.linalg.norm([problem.scales(j).force for j in raising]))
        force = torque / float(np.linalg.norm(levers))
        speed = float(np.abs(np.concatenate(rates)).max())
        scales = JointScales(force, force, rise, speed, 1.0, 1.0, 1.0, 1.0, float(heights.min()), force)
        out.append(End(body, joint, tuple(j for j in raising if j != joint), scales))
    return out
