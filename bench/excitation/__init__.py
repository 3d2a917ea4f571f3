"""Excitation design: what an excitation tells about a rig, and excitations that tell much within limits.

::

    from bench.excitation import Experiment, Hypothesis, Limits, RigPrior, Uncertain, design

    prior = RigPrior((Hypothesis("gap", rig, (Uncertain("gap.clearance", 2e-3, 12e-3),)),))
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
from bench.excitation.ensemble import Ensemble
from bench.excitation.experiment import Experiment
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
from bench.excitation.linear_structure import LinearStructure, linear_structure
from bench.excitation.methods import METHODS, Design, controls_from, design
from bench.excitation.prior import Draw, Hypothesis, RigPrior, Uncertain
from bench.excitation.rivals import RivalDraws, Rivals

__all__ = [
    "METHODS",
    "Contrast",
    "Design",
    "Directions",
    "Draw",
    "Ensemble",
    "Experiment",
    "Hypothesis",
    "Limits",
    "LinearStructure",
    "Peaks",
    "RigPrior",
    "RivalDraws",
    "Rivals",
    "Sensitivity",
    "Uncertain",
    "contrast_of",
    "controls_from",
    "design",
    "directions",
    "expected_log_bayes_factor",
    "feasible",
    "fisher_information",
    "linear_structure",
    "log_det",
    "misfit",
    "sensitivity",
]
