"""Every effect at every place of an articulated model where it may sit."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from bench.discrepancy.articulated_effects.effect import ArticulatedEffect, JointScales
from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_search.ends import ends_within
from bench.discrepancy.articulated_search.problem import ArticulatedProblem

BASE = "base"
"""Name of the place on which the model stands."""
AND = "+"
"""Between the names of two joints that share an effect."""


def placements(problem: ArticulatedProblem, catalogue: Sequence[ArticulatedEffect]) -> list[PlacedOnJoint]:
    """Every effect at every place where it may sit: joints, neighbours, bodies, the base, ends of the tree, drives, encoders."""
    out = list[PlacedOnJoint]()
    at_ends = [effect for effect in catalogue if effect.site == "end"]
    for j in range(len(problem.joints)):
        scales = problem.scales(j)
        for effect in catalogue:
            out += _at(problem, effect, j, scales) if effect.site != "end" else ()
    for end in ends_within(problem) if at_ends else ():
        out += [PlacedOnJoint(effect, end.body, end.joint, end.scales, end.others) for effect in at_ends]
    return out


def _at(
    problem: ArticulatedProblem, effect: ArticulatedEffect, j: int, scales: JointScales
) -> list[PlacedOnJoint]:
    """The places of an effect at joint `j`; of two neighbours it belongs to the first."""
    joint = problem.joints[j]
    drive = joint.drive
    assert drive is not None
    if effect.servo is not None and effect.servo != drive.servo:
        return []
    if effect.hinge is not None and effect.hinge != (joint.unit == "rad"):
        return []
    if effect.needs == "velocity" and problem.records[0].joints[j].n_measured < 2:
        return []
    if effect.site == "pair":
        near = problem.model.neighbours(j)
        later = [i for i, other in enumerate(problem.joints) if i > j and other.name in near]
        return [
            PlacedOnJoint(effect, f"{joint.name}{AND}{problem.joints[i].name}", j, scales, (i,))
            for i in later
        ]
    if effect.site == "base":
        return [PlacedOnJoint(effect, BASE, j, scales)] if j == 0 and problem.model.gravity.any() else []
    names = {"joint": joint.name, "sensor": joint.name, "actuator": drive.name, "body": joint.body}
    return [PlacedOnJoint(effect, names[effect.site], j, scales)]


def apart(candidates: Sequence[PlacedOnJoint], taken: Collection[PlacedOnJoint]) -> list[PlacedOnJoint]:
    """Candidates without those that several joints share and one of them shares already: a drive with a neighbour, a surface."""
    shared = {(placed.effect.site, j) for placed in taken if placed.others for j in placed.joints}
    return [c for c in candidates if not c.others or not shared & {(c.effect.site, j) for j in c.joints}]
