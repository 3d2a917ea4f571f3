"""D4: the published network as Nastran bulk data, and the expanded equations that it stands for.

References:
    Tasbihgoo 2006, eqs 5.16 to 5.46 and appendix B.3.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from bench.demo.joint import (
    JOINT_SETUP,
    excitation,
)
from bench.figures import style, time_histories
from bench.figures.look import axes_grid
from bench.laws.network import published_network
from bench.nastran import (
    INCH_POUND,
    ExpandedSystem,
    LagStudy,
    expanded_system,
    integrate,
    lag_study,
    network_text,
    network_weights,
    parse_deck,
    read_network,
)
from bench.nastran.bulk import Format
from bench.progress import ShowProgress
from bench.recording import Recording
from bench.reproduction import original_deck
from bench.reproduction.chain_joint import AXES
from bench.reproduction.estimates import fine
from bench.reproduction.item import Item, Picture
from bench.reproduction.verdict import Row, fact_row, value_row
from bench.rig import Element, simulate
from bench.rig.library import chain_rig


@dataclass(frozen=True)
class NastranSystemSetup:
    """Numbers of `bench.reproduction.nastran_system`."""

    duration: float = 10.0
    components: tuple[int, int] = (1, 4)
    """Translation along and rotation about x of the deck's virtual grid."""


SETUP = NastranSystemSetup()


def element() -> Element:
    """The published network between bodies 2 and 3."""
    printed = published_network()
    return Element(printed.law, AXES, printed.theta, name="joint")


def swapped() -> tuple[Recording, np.ndarray]:
    """The chain with the network as an element in MuJoCo, and the commands (n, 2)."""
    commands = excitation(True, True).sample(np.random.default_rng(JOINT_SETUP.unseen_seed))[
        : int(1000 * SETUP.duration)
    ]
    record = simulate(chain_rig(element()), {"force": commands[:, 0], "torque": commands[:, 1]})
    return record, commands


def difference(system: ExpandedSystem, record: Recording, commands: np.ndarray) -> tuple[float, np.ndarray]:
    """Largest difference over the peak, of relative states and forces; and the relative states (n, 2)."""
    response = integrate(system, commands)
    worst = 0.0
    for i in range(2):
        for ours, name in ((response.relative, "displacement"), (response.force, "force")):
            true = record[f"joint/{name}_{i + 1}"]
            worst = max(worst, float(np.max(np.abs(ours[:, i] - true)) / np.max(np.abs(true))))
    return worst, np.asarray(response.relative)


def smooth_drive(time: np.ndarray) -> np.ndarray:
    """Smooth commands (n, 2) [N, N m] of the deck's order, for the study of the step."""
    ramp = np.minimum(time / 0.2, 1.0)[:, None] ** 2
    axial = 3000.0 * np.sin(8.0 * time) + 900.0 * np.sin(17.0 * time)
    return ramp * np.stack([axial, 60.0 * np.sin(26.0 * time)], axis=1)


def _deck_rows() -> tuple[list[Row], str]:
    """Write the network as cards in each format, read it back, and count the cards."""
    weights = network_weights(element())
    rows: list[Row] = []
    # Digits that the fields of each format hold: large fields nine after the point, small fields three.
    formats: tuple[tuple[Format, float], ...] = (("large", 1e-8), ("free", 1e-8), ("small", 5e-3))
    for form, tolerance in formats:
        text = network_text(
            element(), form=form, components=SETUP.components, bodies=(3, 4), units=INCH_POUND
        )
        back = read_network(parse_deck(text), units=INCH_POUND).weights
        worst = max(
            float(np.max(np.abs(ours - true)) / np.max(np.abs(true)))
            for ours, true in zip(back, weights, strict=True)
        )
        rows.append(
            value_row(
                f"deck written and read back, {form} fields: largest difference of a weight over the largest",
                "1",
                None,
                worst,
                high=tolerance,
                reason="digits that the fields of the format hold",
            )
        )
    deck = parse_deck(
        network_text(element(), form="large", components=SETUP.components, bodies=(3, 4), units=INCH_POUND)
    )
    counts = Counter(type(card).__name__ for card in deck.cards)
    return rows, ", ".join(f"{count} {name}" for name, count in counts.most_common())


def _lag_figure(study: LagStudy):
    with style():
        figure, grid = axes_grid(5.0, 3.4)
        axes = grid[0, 0]
        for i, name in enumerate(("x of the joint", "θ of the joint")):
            axes.loglog(1e3 * study.steps, 100.0 * study.errors[:, i], "o-", label=name)
        axes.set_xlabel("time step [ms]")
        axes.set_ylabel("RMS error over RMS [%]")
        axes.legend()
    return figure


def _rows(
    order: int, found: dict[str, float], deck: list[Row], cards: str, study: LagStudy
) -> tuple[Row, ...]:
    return (
        value_row(
            "equations of the expanded system",
            "1",
            72.0,
            float(order),
            low=72.0,
            high=72.0,
            source="p. 126, number (s4)",
            reason="a count",
        ),
        value_row(
            "expanded system (deck's form) against the direct swap: largest difference over peak",
            "1",
            None,
            found["deck"],
            high=1e-8,
            reason="the same system by the same Runge-Kutta steps: rounding, amplified by some seconds of motion",
        ),
        value_row(
            "expanded system (printed form, eqs 5.41, 5.63) against the direct swap",
            "1",
            None,
            found["printed"],
            high=1e-8,
            reason="the same",
        ),
        *deck,
        fact_row(
            "cards of the deck",
            cards,
            all(name in cards for name in ("DmigColumn", "Nolin1", "Sload", "ScalarPoints", "Tabled1")),
            printed="DMIG, SPOINT, SLOAD, NOLIN1, TABLED1",
            source="appendix B.3, pp. 159 to 172, cards",
            tolerance="all five kinds",
            reason="a kind of card is there or not",
        ),
        value_row(
            "Nastran's evaluation (NOLIN1 one step late): error of x at 0.08 ms",
            "%",
            None,
            100.0 * float(study.errors[0, 0]),
            reason="reported",
        ),
        value_row(
            "order of that error in the step",
            "1",
            None,
            float(np.mean(study.orders)),
            low=0.9,
            high=1.1,
            reason="a load one step late is an error of first order",
        ),
    )


def _pictures(record: Recording, relative: np.ndarray, study: LagStudy) -> tuple[Picture, ...]:
    names = {"axial_23": 0, "torsional_23": 1}
    expanded = record.with_channels({name: relative[:, i] for name, i in names.items()})
    return (
        Picture(
            "response",
            "Relative motion of the joint: MuJoCo with the network as an element, and the 72 equations of the deck.",
            fine(
                time_histories(
                    {"direct swap": record, "72 equations": expanded},
                    list(names),
                    window=(4.0, SETUP.duration),
                )
            ),
        ),
        Picture(
            "step",
            "What the deck's explicit loads cost: the error grows in proportion to the step.",
            _lag_figure(study),
        ),
    )


def run(progress: ShowProgress) -> Item:
    """Make the item."""
    progress("bulk data", 0.05)
    deck, cards = _deck_rows()
    progress("direct swap and expanded systems", 0.2)
    record, commands = swapped()
    systems = {form: expanded_system(chain_rig(element()), form=form) for form in ("deck", "printed")}
    found = {form: difference(system, record, commands) for form, system in systems.items()}
    progress("Nastran's evaluation over the step", 0.6)
    study = lag_study(
        systems["deck"], smooth_drive, duration=1.0, steps=[8e-5, 1.6e-4, 3.2e-4], start="consistent"
    )
    worst = {form: largest for form, (largest, _) in found.items()}
    text = (
        "The published network of 30 units between bodies 2 and 3 of the chain: as an element in MuJoCo, "
        "as the 8 + 2 + 30 + 30 + 2 equations of section 5.2 assembled from the rig's matrices, and as "
        "bulk data. All three are the same system; the first two are integrated by the same Runge-Kutta "
        "steps and differ by rounding. Nastran evaluates NOLIN1 loads from past steps, so that its "
        "restoring force lags: this is integrated here from the published algorithm, and explains the "
        "deck's step of 0.01 ms."
    )
    rows = (*_rows(systems["deck"].order, worst, deck, cards, study), *original_deck.rows())
    return Item(
        text, rows, _pictures(record, found["deck"][1], study), "nothing; the numbers are the printed cards'"
    )
