"""Windows of many cases, each advanced and booked in one go by whichever thread is free.

The merit of a window depends on the commands only, so that prior draws can run while MuJoCo runs the hidden rigs and while Python
books what was measured. Cases are claimed one by one from a counter that the threads share: no thread waits for another
one's share.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from bench.excitation.bayes_factor import Contrast, accumulate_contrast, weigh_contrast
from bench.excitation.ensemble import Ensemble
from bench.excitation.information import (
    INFORMATION_LIMITS,
    accumulate,
)
from bench.excitation.stepping import Run, advance_cases
from bench.laws.calling import claim


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _advance(counter, run):
    """Advance the cases that this thread claims."""
    case = claim(counter)
    while case < run.controls.shape[0]:
        advance_cases(case, case + 1, run)
        case = claim(counter)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _advance_prior(counter, run, counts, weights, fisher, score, square, values):
    """Advance, and add to the information about each draw; see `bench.excitation.information.accumulate`."""
    case = claim(counter)
    while case < run.controls.shape[0]:
        advance_cases(case, case + 1, run)
        accumulate(
            case,
            case + 1,
            run.outputs,
            counts,
            INFORMATION_LIMITS.step,
            weights,
            None,
            fisher,
            score,
            square,
            values,
        )
        case = claim(counter)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _advance_rivals(counter, run, places, counts, weights, contrast, values):
    """Advance, and weigh each pair of rivals; see `bench.excitation.bayes_factor`."""
    case = claim(counter)
    while case < run.controls.shape[0]:
        advance_cases(case, case + 1, run)
        accumulate_contrast(
            case, case + 1, run.outputs, places, counts, INFORMATION_LIMITS.step, weights, contrast
        )
        weigh_contrast(case, case + 1, contrast, values)
        case = claim(counter)


class WindowUnderWay:
    """A window of all cases under way.

    The other threads of the ensemble begin at once; the one that made it takes part when it calls `finish`.
    """

    def __init__(self, ensemble: Ensemble, run: Run, work: Callable[..., None], *arguments: Any) -> None:
        self.outputs = run.outputs
        counter = np.zeros(1, dtype=np.int64)
        self._task = lambda: work(counter, run, *arguments)
        self._others: list[Future] = ensemble.begin(self._task, len(run.controls))

    def finish(self) -> None:
        """Take part until all cases are done."""
        self._task()
        for other in self._others:
            other.result()


def advance_window(ensemble: Ensemble, run: Run) -> WindowUnderWay:
    """Begin to advance cases."""
    return WindowUnderWay(ensemble, run, _advance)


def advance_prior(
    ensemble: Ensemble,
    run: Run,
    counts: NDArray[np.int64],
    weights: NDArray[np.float64],
    books: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    values: NDArray[np.float64],
) -> WindowUnderWay:
    """Begin to advance draws from a prior, adding to their information and writing its ``log det(I + F)``.

    Args:
        ensemble: The draws and their perturbed ones.
        run: The cases.
        counts: Parameters of each draw ``(n_cases, n_draws)``, −1 for no draw.
        weights: One over the noise standard deviations ``(n_channels,)``.
        books: Fisher information, score and square of `bench.excitation.information.accumulate`; only the first is added to.
        values: ``(n_cases, n_draws)``, written.
    """
    return WindowUnderWay(ensemble, run, _advance_prior, counts, weights, *books, values)


def advance_rivals(
    ensemble: Ensemble,
    run: Run,
    places: NDArray[np.int64],
    counts: NDArray[np.int64],
    weights: NDArray[np.float64],
    contrast: Contrast,
    values: NDArray[np.float64],
) -> WindowUnderWay:
    """Begin to advance pairs of rivals, adding to their contrast and writing its expected log Bayes factor [nat].

    Args:
        ensemble: The rivals and their perturbed ones.
        run: The cases.
        places: Members of the two rivals of each pair ``(n_cases, n_pairs, 2)``.
        counts: Their numbers of parameters ``(n_cases, n_pairs, 2)``; −1 for no pair.
        weights: One over the noise standard deviations ``(n_channels,)``.
        contrast: Sums with leading axes (n_cases, n_pairs), added to.
        values: ``(n_cases, n_pairs)``, written.
    """
    return WindowUnderWay(ensemble, run, _advance_rivals, places, counts, weights, contrast, values)
