"""What the reproduction of one figure or table yields: rows beside the printed values, and pictures."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, NamedTuple

from bench.reproduction.verdict import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Picture(NamedTuple):
    """A figure of an item.

    Attributes:
        name: Part of its file name.
        caption: What it shows, with the number of the printed figure.
        figure: The figure.
        shows: Panels of the dissertation that it stands beside, of `bench.reproduction.printed_figures.PANELS`.
    """

    name: str
    caption: str
    figure: Figure
    shows: tuple[str, ...] = ()


class Shown(NamedTuple):
    """A picture as it was written.

    Attributes:
        file: Its file name in the output folder.
        caption: As of `Picture`.
        shows: As of `Picture`.
    """

    file: str
    caption: str
    shows: tuple[str, ...]


@dataclass(frozen=True)
class Item:
    """What one figure or table of the dissertation became.

    Attributes:
        text: How it was made, and what to make of it.
        rows: Quantities beside the printed ones.
        pictures: Figures.
        searched: What was searched, chosen or tuned so that the printed comes out; "nothing" where nothing was.
    """

    text: str
    rows: tuple[Row, ...]
    pictures: tuple[Picture, ...]
    searched: str = ""


@dataclass(frozen=True)
class Result:
    """An item as it was written.

    Attributes:
        identifier: Its name: "A1", …, "D4".
        title: Its title.
        text: As of `Item`.
        searched: As of `Item`.
        rows: As of `Item`.
        pictures: Its pictures.
        seconds: Time that it took [s].
        version: Fingerprint of the code it was made with.
    """

    identifier: str
    title: str
    text: str
    searched: str
    rows: tuple[Row, ...]
    pictures: tuple[Shown, ...]
    seconds: float
    version: str

    @property
    def holds(self) -> bool:
        """Whether everything that can be judged holds, at least in shape."""
        return all(row.holds is not False for row in self.rows)

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON values."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        values["rows"] = [row.to_dict() for row in self.rows]
        values["pictures"] = [shown._asdict() | {"shows": list(shown.shows)} for shown in self.pictures]
        return values | {"holds": self.holds}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Result:
        """The result from the values of `to_dict`."""
        rows = tuple(Row.from_dict(row) for row in values["rows"])
        pictures = tuple(
            Shown(picture["file"], picture["caption"], tuple(picture["shows"]))
            for picture in values["pictures"]
        )
        plain = {
            item.name: values[item.name] for item in fields(cls) if item.name not in {"rows", "pictures"}
        }
        return cls(**plain, rows=rows, pictures=pictures)
