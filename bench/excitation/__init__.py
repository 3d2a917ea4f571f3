"""Excitation design: what an excitation tells about a rig, and excitations that tell much within limits.

::

    from bench.excitation import Experiment, Limits, RigHypothesis, RigPrior, Uncertain, design

    prior = RigPrior((RigHypothesis("gap", rig, (Uncertain("gap.clearance", 2e-3, 12e-3),)),))
    rng = np.random.default_rng(1)
    experiment = Experiment(
        prior,
        noise={"displacement": 1e-4},
        limits=Limits({"shaker": 10.0}, stroke={"displacement": 0.04}),
        draws=prior.draws(8, rng),
    )
    plan = design("d_optimal", experiment, duration=8.0, band=(0.3, 6.0), rng=rng)
    plan.excitation, plan.merit, plan.peaks
"""

from bench.excitation.bayes_factor import Contrast, contrast_of, expected_log_bayes_factor
from bench.excitation.coverage import Coverage, CoverageSettings
from bench.excitation.ensemble import Ensemble
from bench.excitation.estimation import Estimates, Records, estimate
from bench.excitation.experiment import Experiment
from bench.excitation.family import Family, fans
from bench.excitation.information import (
    Directions,
    Sensitivity,
    directions,
    fisher_information,
    log_det,
    misfit,
    sensitivity,
)
from bench.excitation.limits import Limits, Peaks, feasible
from bench.excitation.linear_structure import AffineStructure, linear_structure
from bench.excitation.methods import METHODS, Design, controls_from, design, paired_experiment
from bench.excitation.paced import PacedPlanner
from bench.excitation.plan_policy import PlanPolicy, PlanStage
from bench.excitation.planner import Decision, Planner
from bench.excitation.policy import Policy, find_policy, policy_names
from bench.excitation.prior import Draw, RigHypothesis, RigPrior, Uncertain
from bench.excitation.recurrence import PolicyMemory, Recurrence
from bench.excitation.rival_planner import RivalPlan, RivalPlanner
from bench.excitation.rivals import RivalDraws, Rivals
from bench.excitation.station import Desk, Station

__all__ = [
    "METHODS",
    "AffineStructure",
    "Contrast",
    "Coverage",
    "CoverageSettings",
    "Decision",
    "Design",
    "Desk",
    "Directions",
    "Draw",
    "Ensemble",
    "Estimates",
    "Experiment",
    "Family",
    "Limits",
    "PacedPlanner",
    "Peaks",
    "PlanPolicy",
    "PlanStage",
    "Planner",
    "Policy",
    "PolicyMemory",
    "Records",
    "Recurrence",
    "RigHypothesis",
    "RigPrior",
    "RivalDraws",
    "RivalPlan",
    "RivalPlanner",
    "Rivals",
    "Sensitivity",
    "Station",
    "Uncertain",
    "contrast_of",
    "controls_from",
    "design",
    "directions",
    "estimate",
    "expected_log_bayes_factor",
    "fans",
    "feasible",
    "find_policy",
    "fisher_information",
    "linear_structure",
    "log_det",
    "misfit",
    "paired_experiment",
    "policy_names",
    "sensitivity",
]
