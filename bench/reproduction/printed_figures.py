"""What the dissertation draws: every figure with data by its parts, and the page it stands on.

A test holds this list against the pictures of all items, so that no figure is left out for being unfavourable. Figures
without data (photographs, drawings, wiring, diagrams of models) are 2.1 to 2.5, 3.1, 3.2, 4.1 to 4.5, 4.11 to 4.13, 5.1 to
5.5 and 5.7.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType


@dataclass(frozen=True)
class PrintedFiguresSetup:
    """Numbers of `bench.reproduction.printed_figures`."""

    drawn: Mapping[str, tuple[int, str]] = field(
        default_factory=lambda: {
            "2.6": (19, "abcd"),
            "2.7": (20, "abc"),
            "2.8": (21, "abcd"),
            "2.9": (22, "abcde"),
            "2.10": (23, "ab"),
            "2.11": (29, "abcd"),
            "2.12": (30, ""),
            "2.13": (32, ""),
            "2.14": (33, "abcdef"),
            "2.15": (35, ""),
            "2.16": (36, "abcd"),
            "2.17": (37, ""),
            "3.3": (48, "abcde"),
            "3.4": (50, "abcd"),
            "3.5": (52, "abc"),
            "3.6": (53, ""),
            "3.7": (54, ""),
            "3.8": (56, "abc"),
            "3.9": (57, "abc"),
            "3.10": (60, "abcde"),
            "3.11": (62, "abc"),
            "3.12": (63, "abcdef"),
            "4.6": (78, "abc"),
            "4.7": (80, "ab"),
            "4.8": (81, "abcd"),
            "4.9": (82, "ab"),
            "4.10": (83, "abcd"),
            "4.14": (88, "abc"),
            "4.15": (90, "abcd"),
            "4.16": (91, "abcd"),
            "4.17": (92, "abcd"),
            "4.18": (94, "abcd"),
            "5.6": (122, "ab"),
            "5.8": (130, "abcd"),
            "5.9": (131, "abcd"),
            "5.10": (134, ""),
            "5.11": (135, ""),
            "5.12": (137, ""),
        }
    )


SETUP = PrintedFiguresSetup()

PAGES: Mapping[str, int] = MappingProxyType({number: page for number, (page, _) in SETUP.drawn.items()})
"""Page of each figure with data."""

PANELS: tuple[str, ...] = tuple(
    f"{number} {part}".strip() for number, (_, parts) in SETUP.drawn.items() for part in (parts or " ")
)
"""Every panel: "2.6 a", …; the number alone where a figure's parts are not told apart here."""


def fig(panel: str) -> str:
    """Where a panel stands: "Fig 2.6 a, p. 19".

    Args:
        panel: Number and parts, as "2.6 a" or "2.8".
    """
    return f"Fig {panel}, p. {PAGES[panel.split(maxsplit=1)[0]]}"


def panels(number: str, parts: str = "") -> tuple[str, ...]:
    """Panels of a figure.

    Args:
        number: Its number.
        parts: The parts wanted; the figure as a whole where empty.
    """
    return tuple(f"{number} {part}" for part in parts) if parts else (number,)
