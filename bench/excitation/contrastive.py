"""Prior contrastive estimation: a bound on the information that a record gives about a rig's parameters.

The rig that is there is held against L others that might have been. ``log p(y | x_0) - log (1 / (L + 1)) sum_l p(y | x_l)``, the sum
over the rig and its contrasts, has an expectation over rigs and records that is at most the information gained, and at most
``log(L + 1)``: contrasts from a wide prior are all told apart within a second, and the bound says no more. Contrasts from a prior that
is already narrowed to a scale ask what the record adds for somebody who knows the parameters so far; a ladder of scales asks it at
every stage.

References:
    Foster, Ivanova, Malik, Rainforth 2021, "Deep Adaptive Design", ICML, eq. 12 (sequential prior contrastive estimation);
    Foster, Jankowiak, O'Meara, Teh, Rainforth 2020, AISTATS (the bound for a single experiment).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import truncnorm


def contrastive_bound(truth: NDArray[np.float64], contrasts: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a record tells of the true rig among its contrasts [nat] ``(…)``, at most ``log(L + 1)``.

    Args:
        truth: Log-likelihood of the record given the true rig ``(…)``.
        contrasts: Given each of the others ``(…, L)``; minus infinity where a rig diverged.
    """
    everyone = np.concatenate([truth[..., None], contrasts], axis=-1)
    return truth - logsumexp(everyone, axis=-1) + math.log(everyone.shape[-1])


def local_contrasts(
    coordinates: NDArray[np.float64], scale: float, n: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Contrasts for somebody who has measured the parameters once, with a normal error of a scale ``(m, n, p)``.

    The measurement is drawn; rig and contrasts are then draws from the same narrowed prior, which makes the bound hold.

    Args:
        coordinates: Standardised parameters of the true rigs ``(m, p)``, uniform in ±√3 under the prior.
        scale: Standard deviation of that error [prior standard deviations].
        n: Contrasts of each rig.
        rng: Source of randomness.
    """
    m, p = coordinates.shape
    told = (coordinates + scale * rng.standard_normal((m, p)))[:, None]
    bound = math.sqrt(3.0)
    low, high = (-bound - told) / scale, (bound - told) / scale
    return np.asarray(
        truncnorm.rvs(low, high, loc=told, scale=scale, size=(m, n, p), random_state=rng), dtype=float
    )
