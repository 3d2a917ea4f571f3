"""Which explanations count as indistinguishable, and how sure their effects are."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.judgement.closing import as_borne_out
from bench.discrepancy.judgement.doubt import like_a_stand_in, outside
from bench.discrepancy.judgement.posterior import indistinguishable
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.settings import DEFAULT
from bench.discrepancy.verdict import NamedEffect, Ranked

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


def test_further_effect_that_closes_nothing_for_sure_is_no_surer_than_even():
    def effect(name, closed, *ends):
        return NamedEffect(name, "piston", 0.99, {}, closed=closed, closed_ci95=ends)

    named = [
        effect("bouc_wen_hysteresis", 0.97, 0.96, 1.0),
        effect("cubic_stiffness", 0.01, 0.004, 0.02),
        effect("acceleration_hum", 0.0, 0.0, 0.0),  # of a channel that is not judged
        effect("load_dependent_friction", -2e-4, -2e-3, 3e-3),
    ]
    ranking = [Ranked(e.name, e.where, e.probability) for e in reversed(named)]
    kept, ranked = as_borne_out(named, ranking)
    assert [e.name for e in kept] == [e.name for e in named]
    assert [e.probability for e in kept] == [0.99, 0.99, 0.99, 0.5]
    assert (ranked[-1].name, ranked[-1].probability) == ("load_dependent_friction", 0.5)
    small, _ = as_borne_out(named, ranking, least=0.05)
    assert [e.probability for e in small] == [0.99, 0.5, 0.99, 0.5]
    alone = as_borne_out([effect("gap", -0.1, -0.2, 0.1)], [])[0]
    assert alone[0].probability == 0.99  # what is named at all is judged as a whole


def test_cause_beside_a_nominal_parameter_moved_to_where_it_is_hardly_believed_is_not_certain():
    stays, moves = [0.4, -1.1, 0.7], [0.4, -4.0, 0.7]
    assert like_a_stand_in(stays) == like_a_stand_in([]) == 1.0
    assert outside(0.01, moved=stays) == pytest.approx(DEFAULT.judgement.coarse.unlike)
    assert 0.1 < outside(0.01, moved=moves) < 0.5  # a wrong number is as likely as a wrong cause
    # one of twelve is nearer to what chance makes than one of three
    assert outside(0.01, moved=stays * 3 + moves) < outside(0.01, moved=moves)


def test_parameter_tells_the_more_against_a_cause_the_farther_it_moves():
    odds = [like_a_stand_in([far, 0.0]) for far in (2.0, 2.5, 3.0, 3.5, 4.0)]
    assert odds == sorted(odds)
    assert like_a_stand_in([3.0, 0.0]) == like_a_stand_in([-3.0, 0.0])
