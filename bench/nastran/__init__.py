"""Reduced-order joints in Nastran: write an identified network as bulk data, read such a deck, integrate what it states.

`write_network` and `read_network` move a network between an `Element` and a deck; `expanded_system` assembles the
equations that the deck adds to a model (5.16 to 5.46), and `integrate` solves them consistently or as Nastran does.
"""

from bench.nastran.bulk import Deck, card_lines, deck_text, parse_deck, read_deck, write_deck
from bench.nastran.cards import (
    DmigColumn,
    DmigHeader,
    Grid,
    Lseq,
    Mpc,
    Nolin1,
    OtherCard,
    ScalarPoints,
    Sload,
    Tabled1,
    Tload1,
)
from bench.nastran.expanded import ExpandedSystem, expanded_system
from bench.nastran.integration import Response, integrate
from bench.nastran.joint_model import JointAxis, JointModel, joint_model_cards, read_joint_model
from bench.nastran.lag_study import LagStudy, lag_study
from bench.nastran.network_deck import (
    INCH_POUND,
    SI,
    Numbering,
    Units,
    network_cards,
    network_text,
    network_weights,
    write_network,
)
from bench.nastran.network_reading import DeckNetwork, read_network
from bench.nastran.tanh_table import table_error, tanh_points

__all__ = [
    "INCH_POUND",
    "SI",
    "Deck",
    "DeckNetwork",
    "DmigColumn",
    "DmigHeader",
    "ExpandedSystem",
    "Grid",
    "JointAxis",
    "JointModel",
    "LagStudy",
    "Lseq",
    "Mpc",
    "Nolin1",
    "Numbering",
    "OtherCard",
    "Response",
    "ScalarPoints",
    "Sload",
    "Tabled1",
    "Tload1",
    "Units",
    "card_lines",
    "deck_text",
    "expanded_system",
    "integrate",
    "joint_model_cards",
    "lag_study",
    "network_cards",
    "network_text",
    "network_weights",
    "parse_deck",
    "read_deck",
    "read_joint_model",
    "read_network",
    "table_error",
    "tanh_points",
    "write_deck",
    "write_network",
]
