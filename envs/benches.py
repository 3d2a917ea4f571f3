"""The benches behind the environments: any number side by side, stepped together.

The single environment is one bench, the vector environment many; their numbers agree because they are the same code, and because
nothing that a bench computes depends on how many stand beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.excitation import Contrast, Ensemble, RigPrior
from bench.excitation.experiment import fan
from bench.excitation.information import (
    INFORMATION_LIMITS,
    accumulate,
    misfit,
)
from bench.excitation.stepping import run_of
from bench.excitation.windows import WindowUnderWay, advance_prior, advance_rivals, advance_window

from .laboratory import Laboratories
from .options import Options, check_size
from .setups import Setup
from .stepped import SteppedBenches, sensed


class _Panel(NamedTuple):
    """The prior draws of all questions as one ensemble, and where each question's lie in it."""

    ensemble: Ensemble
    members: NDArray[np.int64]  # (n_questions, n_members), −1 beyond a question's own
    n_members: NDArray[np.int64]  # (n_questions,)
    counts: NDArray[np.int64]  # (n_questions, n_draws) parameters, −1 for none
    places: NDArray[np.int64]  # (n_questions, n_draws) among a question's members
    weights: NDArray[np.float64]  # (n_questions, n_draws) prior weights


class _Account(NamedTuple):
    """A window on the prior draws under way."""

    window: WindowUnderWay
    # states, information, score, square and contrast of the benches that run
    books: list[NDArray[np.float64]]
    values: NDArray[np.float64]  # (m, n_draws) or (m, n_pairs), written


@lru_cache(maxsize=16)
def _panel(setup: Setup, threads: int) -> _Panel:
    rigs: list = []
    parts = []
    for experiment in setup.experiments:
        own, places, counts = fan(experiment.rigs_drawn, INFORMATION_LIMITS.step)
        parts.append((len(rigs), len(own), places, counts))
        rigs += own
    n_draws = max(len(part[2]) for part in parts)
    width = max(part[1] for part in parts)
    shape = (len(parts), n_draws)
    members = np.full((len(parts), width), -1, dtype=np.int64)
    counts, places = np.full(shape, -1, dtype=np.int64), np.zeros(shape, dtype=np.int64)
    weights = np.zeros(shape)
    for i, (first, size, at, count) in enumerate(parts):
        members[i, :size] = np.arange(first, first + size)
        counts[i, : len(count)], places[i, : len(at)] = count, at
        question, drawn = setup.questions[i], setup.experiments[i].rigs_drawn
        weights[i, : len(count)] = (
            question.draw_weights(drawn) if isinstance(question, RigPrior) else 1.0 / len(drawn)
        )
    sizes = np.array([part[1] for part in parts], dtype=np.int64)
    ensemble = Ensemble(tuple(rigs), tuple(setup.noise), setup.limits.actuators, threads)
    return _Panel(ensemble, members, sizes, counts, places, weights)


class Benches(SteppedBenches):
    """Laboratories with hidden rigs, and the experimenter's books on them; the merit is averaged over prior draws."""

    def __init__(self, setup: Setup, options: Options, n: int, threads: int = 1) -> None:
        """Set up benches; each must be `reset` before it is stepped."""
        super().__init__(setup, options, n)
        self.setup: Setup = setup  # pyrefly: ignore[bad-override-mutable-attribute]
        self.threads = threads
        self.channels, self.actuators = self.station.channels, self.station.actuators
        hypotheses = [
            h
            for q in setup.questions
            for h in (q.hypotheses if isinstance(q, RigPrior) else (q.first, q.second))
        ]
        self._laboratories = Laboratories(
            tuple(hypotheses), n, channels=self.channels, actuators=self.actuators, threads=(threads + 1) // 2
        )  # the other half of the threads runs the prior draws meanwhile
        self._noise = self.desk.noise
        panel = _panel(setup, threads)
        draws, p = panel.counts.shape[1], int(panel.counts.max())
        self.question = np.zeros(n, dtype=np.int64)
        self._states = np.zeros((n, panel.members.shape[1], panel.ensemble.n_states))
        check_size(
            n * draws * (p * p + p), f"what is known of {draws} draws in {n} environment{'s' * (n > 1)}"
        )
        self._fisher, self._score = np.zeros((n, draws, p, p)), np.zeros((n, draws, p))
        self._square = np.zeros((n, draws))
        self._contrast = Contrast.zeros(n, draws // 2, parameters=p) if self._rivals else None
        self._values = np.zeros((n, draws // 2 if self._rivals else draws))
        self._account: _Account | None = None

    def reset(self, places: NDArray[np.int64], rngs: Sequence[np.random.Generator]) -> NDArray[np.float32]:
        """Put new hidden rigs, at rest, into some benches; return what their sensors show at rest.

        Args:
            places: Benches, ascending ``(m,)``.
            rngs: Generators of all benches; only those of `places` are drawn from.
        """
        panel = _panel(self.setup, self.threads)
        for place in places:
            rng = rngs[place]
            self.question[place] = rng.integers(len(self.setup.questions))
            question = self.setup.questions[self.question[place]]
            self.truth[place] = (question if isinstance(question, RigPrior) else question.prior).draw(rng)
            self._laboratories.install(int(place), self.truth[place])
            rng.standard_normal(out=self._disturbance[place])
        self.desk.begin(places)
        for array in (
            self._merit,
            self._fisher,
            self._score,
            self._square,
            self._values,
        ):
            array[places] = 0.0
        for array in self._contrast or ():
            array[places] = 0.0
        self._states[places] = panel.ensemble.start(panel.members[self.question[places]])
        m = len(places)
        measured = self._noise * self._disturbance[places, -1]
        rest = np.zeros((m, self.n_steps, len(self.actuators)))
        return self.desk.observe(places, measured, rest, np.zeros((m, self.width)), self.question)

    def _measured(
        self, places: NDArray[np.int64], commands: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        if self._coverage is None:
            self._account = self._opened(places, commands)  # of which other threads take care meanwhile
        ideal = self._laboratories.run(places, commands)
        noise = self._noise * self._disturbance[places, self.desk.window[places] % self.n_windows]
        return sensed(ideal, noise)

    def _opened(self, places: NDArray[np.int64], commands: NDArray[np.float64]) -> _Account:
        """Begin to run the window on all prior draws."""
        panel = _panel(self.setup, self.threads)
        asked = self.question[places]
        books = [self._states, self._fisher, self._score, self._square, *(self._contrast or ())]
        if len(places) < self.n:
            books = [np.ascontiguousarray(book[places]) for book in books]
        states, fisher, score, square, *contrast = books
        run = run_of(
            panel.ensemble.packed,
            commands,
            states,
            members=panel.members[asked],
            counts=panel.n_members[asked],
            timestep=self.timestep,
            clock=self._clock(places),
        )
        weights, counts = 1.0 / self._noise, panel.counts[asked]
        if self._rivals:
            pairs = counts.reshape(len(places), -1, 2)
            at, values = panel.places[asked].reshape(pairs.shape), np.zeros(pairs.shape[:2])
            window = advance_rivals(panel.ensemble, run, at, pairs, weights, Contrast(*contrast), values)
        elif self.options.average == "prior":
            values = np.zeros(counts.shape)
            window = advance_prior(panel.ensemble, run, counts, weights, (fisher, score, square), values)
        else:
            values = np.zeros(counts.shape)
            window = advance_window(panel.ensemble, run)
        return _Account(window, books, values)

    def _told(
        self, places: NDArray[np.int64], measured: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        panel, m = _panel(self.setup, self.threads), len(places)
        asked = self.question[places]
        assert self._account is not None  # `_measured` opened it
        (window, books, values), self._account = self._account, None
        _, fisher, score, square, *_ = books
        window.finish()
        if self.options.average == "posterior":
            counts, weights = panel.counts[asked], 1.0 / self._noise
            logarithms = np.zeros(counts.shape)
            panel.ensemble.spread(
                lambda a, b: accumulate(
                    a,
                    b,
                    window.outputs,
                    counts,
                    INFORMATION_LIMITS.step,
                    weights,
                    measured,
                    fisher,
                    score,
                    square,
                    logarithms,
                ),
                m,
            )
            values = values if self._rivals else logarithms
        if self._rivals:
            values = np.log1p(np.maximum(values, 0.0))
        values = np.where(
            np.isfinite(values), values, self._values[places]
        )  # of a draw that diverged: no more
        if m < self.n:
            whole = (self._states, self._fisher, self._score, self._square, *(self._contrast or ()))
            for book, part in zip(whole, books, strict=True):
                book[places] = part
        probability = self._probability(panel.weights[asked], fisher, score, square, self.desk.window[places])
        if self._rivals:
            probability = probability.reshape(m, -1, 2).sum(axis=2)
        gain = np.sum(probability * (values - self._values[places]), axis=1)
        self._values[places] = values
        self._merit[places] += gain
        return gain, 1.0 / np.sum(probability**2, axis=1)

    def _probability(
        self, prior: NDArray, fisher: NDArray, score: NDArray, square: NDArray, windows: NDArray
    ) -> NDArray[np.float64]:
        """Weights of the prior draws ``(m, n_draws)``: the prior's own, or given the measurements so far.

        A handful of draws never meets the hidden rig within the noise, so that the noise level of the sensors would put all
        weight on one of them. The level of the misfit is taken as unknown instead (Jeffreys' prior) and a window as one
        independent observation of it, which makes the likelihood a power of the misfit.
        """
        if self.options.average == "prior":
            return prior
        remainder = np.log(np.maximum(misfit(fisher, score, square), 1e-300))
        logarithm = np.log(np.maximum(prior, 1e-300)) - 0.5 * windows[:, None] * remainder
        weight = np.exp(logarithm - logarithm.max(axis=1, keepdims=True)) * (prior > 0.0)
        return weight / weight.sum(axis=1, keepdims=True)

    def effective_draws(self, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """One over the sum of the squared prior weights of the draws (of the pairs, for rivals) ``(m,)``."""
        weights = _panel(self.setup, self.threads).weights[self.question[places]]
        if self._rivals:
            weights = weights.reshape(len(places), -1, 2).sum(axis=2)
        return 1.0 / np.sum(weights**2, axis=1)

    def positions(self, place: int) -> NDArray[np.float64]:
        """Joint positions of a bench's rig, to be looked at."""
        return self._laboratories.positions(place)
