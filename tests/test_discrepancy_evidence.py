"""Which explanations count as indistinguishable."""

from types import SimpleNamespace

import numpy as np

from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.judgement.posterior import indistinguishable
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.settings import DEFAULT

AXIAL = Place("axial", np.eye(1), "m", "N")


def explanation(log_posterior, *names):
    placed = tuple(Placed(effect_named(name), AXIAL) for name in names)
    return SimpleNamespace(hypothesis=placed, log_posterior=log_posterior, scaled=True, settings=DEFAULT)


def test_effects_that_do_nearly_as_well_in_the_place_of_one_stand_in_a_set_with_it():
    found = [
        explanation(-10.0, "gap", "coulomb_friction"),
        explanation(-10.0 - 0.9 * DEFAULT.judgement.rival, "cubic_stiffness", "coulomb_friction"),
        explanation(-10.0 - 1.1 * DEFAULT.judgement.rival, "gap", "stribeck_friction"),
    ]
    assert indistinguishable(found) == (("cubic_stiffness", "gap"),)


def test_where_the_number_of_effects_cannot_be_told_whole_explanations_stand_in_a_set():
    found = [
        explanation(-10.0, "presliding_friction"),
        explanation(-11.0, "power_law_damping", "bouc_wen_hysteresis"),
        explanation(-11.5, "presliding_friction", "power_law_damping"),
        explanation(-12.0, "bouc_wen_hysteresis"),
        explanation(-12.5),
    ]
    assert indistinguishable(found) == (
        (
            "bouc_wen_hysteresis",
            "bouc_wen_hysteresis + power_law_damping",
            "power_law_damping + presliding_friction",
            "presliding_friction",
        ),
    )


def test_the_nominal_model_alone_stands_in_no_set():
    assert indistinguishable([explanation(-10.0), explanation(-11.0, "gap")]) == ()
