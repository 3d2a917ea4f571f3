"""The background of a rig: small forces that no hypothesis holds, and what they leave of an identification that does not know them.

A real rig is never one of the hypotheses. Its spring is not quite straight, its damper not quite linear; an excitation that lives on
what no real rig repeats, as on motions that part exponentially, tells much of a model and nothing of the rig. To first order the least
squares estimate of the parameters, with their standardised prior, is off by ``(I + F)^-1 (J' (e + d) - x)``: F the information in
the parameters x, J the whitened derivatives at the rig without its background, e the noise and d what the background does to the
record. Noise and prior leave the covariance ``(I + F)^-1``, and the record of the background leaves a bias that does not shrink as the
record gets longer.

References:
    Box, Draper 1959, J. American Statistical Association 54(287) (variance and bias of designs where the model is wrong);
    Ljung 1999, "System Identification", chapter 13 (the same for records).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.excitation.family import Family, fans
from bench.excitation.prior import RigHypothesis, Uncertain
from bench.excitation.stepping import Packed, integrate_cases
from bench.laws import find_law
from bench.rig import Element


@dataclass(frozen=True)
class ExcitationBackgroundSettings:
    """Numbers of `bench.excitation.background`."""

    step: float = 1e-2
    """Step of the differences in standard deviations: what identifications leave of the prior. Over much smaller steps motion that is
    chaotic seems to tell more than any fit finds in it; over larger ones kinks are passed."""


SETTINGS = ExcitationBackgroundSettings()


@dataclass(frozen=True)
class BackgroundTerm:
    """A force that is there besides what a hypothesis holds.

    Attributes:
        law: Name of a law that is linear in its parameter.
        joint: Joint on which it acts.
        parameter: The parameter.
        deviation: Its standard deviation about zero, in the parameter's unit.
    """

    law: str
    joint: str
    parameter: str
    deviation: float

    @property
    def name(self) -> str:
        """Name of its element."""
        return f"background_{self.joint}_{self.law}"

    @property
    def uncertain(self) -> Uncertain:
        """The parameter, uniform about zero."""
        reach = math.sqrt(3.0) * self.deviation
        return Uncertain(f"{self.name}.{self.parameter}", -reach, reach, "linear")


def with_background(hypothesis: RigHypothesis, terms: tuple[BackgroundTerm, ...]) -> RigHypothesis:
    """A hypothesis whose rigs have a background; its coordinates come after those of the hypothesis.

    Args:
        hypothesis: The hypothesis.
        terms: The background.
    """
    elements = []
    for term in terms:
        law = find_law(term.law)
        elements.append(Element(law, (term.joint,), law.theta(**{term.parameter: 0.0}), name=term.name))
    rig = hypothesis.rig.with_(elements=(*hypothesis.rig.elements, *elements))
    parameters = (*hypothesis.parameters, *(term.uncertain for term in terms))
    return RigHypothesis(hypothesis.name, rig, parameters, hypothesis.weight)


def expected_error(information: NDArray[np.float64], score: NDArray[np.float64]) -> NDArray[np.float64]:
    """Error that an identification is expected to leave, root mean square over the parameters [prior standard deviations] ``(…)``.

    Args:
        information: ``F = J'J`` ``(…, p, p)``.
        score: ``J'd`` ``(…, p)``, d the whitened difference between the noiseless records of the rig and of the rig without
            its background; `bench.excitation.information.accumulate` sums both.
    """
    p = score.shape[-1]
    covariance = np.linalg.inv(np.eye(p) + information)
    bias = np.einsum("...ij,...j->...i", covariance, score)
    square = np.trace(covariance, axis1=-2, axis2=-1) + np.sum(bias**2, axis=-1)
    return np.sqrt(square / p)


def bare_and_backed(
    information: NDArray[np.float64], score: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Errors that identification is expected to leave without a background and over all of them ``(k,)``, at most one.

    Args:
        information: ``F = J'J`` ``(k, p, p)``.
        score: ``J'D`` ``(k, p, n_terms)``, see `errors_left`.
    """
    p = information.shape[1]
    covariance = np.linalg.inv(np.eye(p) + information)
    spread = np.trace(covariance, axis1=1, axis2=2)
    bias = np.sum((covariance @ score) ** 2, axis=(1, 2))
    return np.sqrt(np.minimum(spread / p, 1.0)), np.sqrt(np.minimum((spread + bias) / p, 1.0))


def neighbours(real: Family, x: NDArray[np.float64], step: float) -> Packed:
    """A rig, and it moved by a step along one coordinate after the other, all without the laws of a background.

    Args:
        real: The hypothesis with its background, see `with_background`, or without one.
        x: The rig ``(p,)``, standardised, without its background's coordinates.
        step: In prior standard deviations.
    """
    terms = real.n_parameters - len(x)
    packed = real.packed(fans(np.append(x, np.zeros(terms)), step)[: 1 + len(x)])
    own = packed.kernels.shape[1] - terms
    by_element = ("kernels", "sizes", "motion", "inputs", "theta")
    rows = {name: np.ascontiguousarray(getattr(packed, name)[:, :own]) for name in by_element}
    return packed._replace(**rows) if own and terms else packed


def term_rigs(real: Family, x: NDArray[np.float64], size: float) -> Packed:
    """A rig with one term of its background after the other, of so many standard deviations.

    Args:
        real: The hypothesis with its background, see `with_background`.
        x: The rig ``(p,)``, standardised, without its background's coordinates.
        size: Of the term.
    """
    terms = real.n_parameters - len(x)
    packed = real.packed(np.concatenate([np.tile(x, (terms, 1)), size * np.eye(terms)], axis=1))
    background = packed.kernels.shape[1] - terms + np.arange(terms)
    for rig, element in enumerate(background):  # laws whose parameter is zero exert nothing, and need not run
        packed.kernels[rig, background[background != element]] = 0
    return packed


def _records(packed: Packed, controls: NDArray[np.float64], timestep: float) -> NDArray[np.float64]:
    """Records from rest of all rigs under each of several drives ``(n_cases, n_rigs, n, n_channels)``."""
    cases, rigs = len(controls), len(packed.start)
    states = packed.start[None].repeat(cases, axis=0)
    members, counts = np.arange(rigs)[None].repeat(cases, axis=0), np.full(cases, rigs)
    return integrate_cases(packed, controls, states, members=members, counts=counts, timestep=timestep)


class ErrorsLeft(NamedTuple):
    """What identification is expected to leave of one rig after each of k excitations, as by `errors_left`."""

    motion: NDArray[np.float64]  # (k, n, n_channels) of the rig without a background
    bare: NDArray[np.float64]  # (k,) error where it has none [prior standard deviations]
    backed: NDArray[np.float64]  # (k,) error where it has one, over all backgrounds


def errors_left(
    real: Family, x: NDArray[np.float64], controls: NDArray[np.float64], noise: NDArray[np.float64]
) -> ErrorsLeft:
    """What identification is expected to leave of a rig, without a background and over all of them.

    The terms of a background have standard deviation one and are independent of each other: over them the bias is expected to be
    ``|| (I + F)^-1 J' D ||``, the columns of D what each term at its standard deviation does to the record. An error is at most
    one, what is known without a record.

    Args:
        real: The hypothesis with its background, see `with_background`; without one `backed` is `bare`.
        x: The rig ``(p,)``, standardised, without its background's coordinates.
        controls: Commands ``(k, n, n_actuators)``.
        noise: Standard deviations of the channels ``(n_channels,)``.
    """
    p, k = len(x), len(controls)
    packs = (neighbours(real, x, SETTINGS.step), term_rigs(real, x, 1.0))
    y = np.concatenate([_records(packed, controls, real.timestep) for packed in packs], axis=1)
    apart = ((y[:, 1:] - y[:, :1]) / noise).reshape(k, real.n_parameters, -1)
    slopes, terms = apart[:, :p] / SETTINGS.step, apart[:, p:]
    information, score = slopes @ slopes.transpose(0, 2, 1), slopes @ terms.transpose(0, 2, 1)
    known = np.isfinite(information).all(axis=(1, 2)) & np.isfinite(score).all(axis=(1, 2))
    information[~known], score[~known] = 0.0, 0.0
    return ErrorsLeft(y[:, 0], *bare_and_backed(information, score))
