"""Every item that can be reproduced, in the order of the dissertation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from types import MappingProxyType

from bench.errors import UnknownNameError
from bench.progress import ShowProgress
from bench.reproduction.item import Item


@dataclass(frozen=True)
class ItemEntry:
    """An item by its name.

    Attributes:
        identifier: "A1", …, "D4".
        title: Title with the numbers of the printed figures and tables.
        module: Module in this package whose `run` makes it; imported when it is made.
        weight: Share of the whole's time, about its seconds.
    """

    identifier: str
    title: str
    module: str
    weight: float = 2.0

    def run(self, progress: ShowProgress) -> Item:
        """Make the item."""
        return import_module(f"bench.reproduction.{self.module}").run(progress)


_ENTRIES = (
    ItemEntry("A1", "Free vibration after impulses (Fig 2.6)", "free_vibration"),
    ItemEntry("A2", "Gap under wide-band random excitation (Figs 2.7, 2.8)", "gap"),
    ItemEntry("A3", "Sliding friction, constant and modulated (Figs 2.9, 2.10)", "sliding_friction"),
    ItemEntry(
        "A4", "Simulated Bouc-Wen hysteresis identified on line (Figs 2.11-2.13)", "simulated_hysteresis", 6.0
    ),
    ItemEntry("A5", "Hysteretic rig identified on line (Figs 2.14-2.17)", "hysteretic_rig", 6.0),
    ItemEntry(
        "B1",
        "Damper design model over 202 harmonic tests (Figs 3.3, 3.4, 3.10, Tables 3.1, 3.2)",
        "damper_design",
        20.0,
    ),
    ItemEntry(
        "B2", "Damper polynomial model under random excitation (Figs 3.5-3.9)", "damper_polynomial", 10.0
    ),
    ItemEntry("B3", "Order of the damper polynomial model (Figs 3.11, 3.12)", "damper_order", 30.0),
    ItemEntry(
        "C2", "Coupled joint: polynomial and network (Figs 4.6-4.10, section 4.5)", "coupled_joint", 120.0
    ),
    ItemEntry("C3", "Laboratory joint (Figs 4.14-4.18, 5.10-5.12)", "laboratory_joint", 60.0),
    ItemEntry("C4", "Joint identified without the mass (section 4.5)", "unknown_mass", 60.0),
    ItemEntry("D1", "Linear chain of four bodies (Fig 5.3, eqs 5.47-5.53)", "linear_chain"),
    ItemEntry("D3", "Reduced-order joint in the chain (Figs 5.4, 5.8, 5.9)", "chain_joint", 90.0),
    ItemEntry(
        "D4",
        "Joint and network as Nastran bulk data (eqs 5.16-5.46, 5.55, appendices B.1 to B.3)",
        "nastran_system",
        20.0,
    ),
    ItemEntry(
        "D5",
        "Frame on an isolator with dampers, four reduced-order joints at once (chapter 6)",
        "frame",
        60.0,
    ),
)

ENTRIES: Mapping[str, ItemEntry] = MappingProxyType({entry.identifier: entry for entry in _ENTRIES})
"""Every item by its name."""

ALIASES: Mapping[str, str] = MappingProxyType({"C1": "C2", "D2": "D3"})
"""Systems that are made as part of another item."""


def find_entries(identifiers: Sequence[str] | None) -> tuple[ItemEntry, ...]:
    """The items asked for, each once, in the order of the dissertation.

    Args:
        identifiers: Names in any case; a chapter's letter stands for all of its items. All items where None or empty.

    Raises:
        UnknownNameError: There is no such item.
    """
    if not identifiers:
        return _ENTRIES
    wanted: set[str] = set()
    for given in identifiers:
        name = ALIASES.get(given.upper(), given.upper())
        found = {key for key in ENTRIES if name in (key, key[0])}
        if not found:
            raise UnknownNameError("item of the reproduction", given, [*ENTRIES, *ALIASES])
        wanted |= found
    return tuple(entry for entry in _ENTRIES if entry.identifier in wanted)
