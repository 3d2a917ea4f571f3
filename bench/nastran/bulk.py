"""Bulk data as text: small field, large field and free field, with continuation lines, comments and includes.

Reading accepts any mixture of the three forms, line by line, as Nastran does: a comma makes a line free field, an
asterisk after the name (or in front of a continuation) makes it large field with four data fields of 16 characters,
anything else is small field with eight of 8. A line whose first field is blank or begins with ``+`` or ``*`` continues
the card above it. Continuations must follow their card (Nastran would sort them by their names in fields 10 and 1; decks
that rely on it are refused). Executive and case control are passed over: reading begins after ``BEGIN BULK`` where a
file has that line.

Cards without real numbers are written in small fields, which hold any identification number. Free field is written with
asterisks and four values a line where a card holds real numbers, since plain free fields hold 8 characters as small
fields do.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar, get_args

from bench.errors import FileFormatError, UnknownNameError
from bench.files import write_text
from bench.limits import READING_LIMITS, ReadingLimits, regular_file, size_text
from bench.nastran.cards import Field
from bench.nastran.interpretation import interpret
from bench.nastran.numbers import integer_text, real_text
from bench.nastran.raw_card import Card, DeckPlace, RawCard

Format = Literal["small", "large", "free"]

C = TypeVar("C", bound=Card)


@dataclass(frozen=True)
class BulkSettings:
    """Numbers of `bench.nastran.bulk`."""

    deepest: int = 10


SETTINGS = BulkSettings()
_QUOTES = "'\"‘’`"


@dataclass(frozen=True)
class Deck:
    """The cards of a deck, in order.

    Attributes:
        cards: Typed cards, and `OtherCard` for those that are not interpreted.
    """

    cards: tuple[Card, ...]

    def of(self, kind: type[C]) -> tuple[C, ...]:
        """All cards of one type."""
        return tuple(card for card in self.cards if isinstance(card, kind))


def read_deck(path: str | Path, *, limits: ReadingLimits = READING_LIMITS) -> Deck:
    """Read a deck and the files it includes.

    Args:
        path: The file; ``INCLUDE 'name'`` is looked for beside it, and not outside its folder.
        limits: What deck and included files may cost together.

    Raises:
        FileFormatError: The file cannot be read, or a card is malformed; names file, line, card and field.
    """
    return _deck(_Reader(Path(path).parent, limits).lines(Path(path), ()))


def parse_deck(text: str, *, source: str = "deck") -> Deck:
    """Read a deck from text; `source` names it in messages.

    Raises:
        FileFormatError: A card is malformed, or the text includes a file.
    """
    return _deck(_Reader(None, READING_LIMITS).numbered(text, source, ()))


def _deck(lines: Iterable[tuple[DeckPlace, str]]) -> Deck:
    return Deck(tuple(interpret(raw) for raw in raw_cards(lines)))


class _Reader:
    """Lines of a deck and of what it includes, counted against the limits."""

    def __init__(self, home: Path | None, limits: ReadingLimits) -> None:
        self.home, self.limits = home, limits
        self.files, self.bytes = 0, 0

    def lines(self, path: Path, chain: tuple[Path, ...]) -> Iterator[tuple[DeckPlace, str]]:
        """Lines of a file; `chain` are the files that led to it."""
        try:
            content = regular_file(path, self.limits.model_bytes).read_bytes()
        except (OSError, FileFormatError) as error:
            raise FileFormatError(f"cannot read {path}: {error}") from error
        self.files, self.bytes = self.files + 1, self.bytes + len(content)
        if self.files > self.limits.included or self.bytes > self.limits.model_bytes:
            raise FileFormatError(
                f"the deck includes {self.files - 1} files of {size_text(self.bytes)}; at most {self.limits.included} files of "
                f"{size_text(self.limits.model_bytes)} are read: merge them"
            )
        return self.numbered(content.decode("utf-8", errors="replace"), path.name, (*chain, path.resolve()))

    def numbered(self, text: str, source: str, chain: tuple[Path, ...]) -> Iterator[tuple[DeckPlace, str]]:
        """Lines of a text without comments, each with its place; includes followed."""
        lines = text.splitlines()
        upper = [" ".join(line.split("$")[0].upper().split()) for line in lines]
        start = upper.index("BEGIN BULK") + 1 if "BEGIN BULK" in upper else 0
        for number in range(start, len(lines)):
            place = DeckPlace(source, number + 1)
            line = lines[number].split("$")[0].expandtabs(8).rstrip()
            if upper[number].startswith("ENDDATA"):
                return
            if not upper[number].startswith("INCLUDE"):
                if line:
                    yield place, line
                continue
            name = line.strip()[len("INCLUDE") :].strip().strip(_QUOTES)
            yield from self.lines(self._included(name, place, chain), chain)

    def _included(self, name: str, place: DeckPlace, chain: tuple[Path, ...]) -> Path:
        """Path of an included file.

        Raises:
            FileFormatError: It has no name, lies outside the deck's folder, includes itself or is nested too deeply.
        """
        why = "has no file name" if not name else ""
        if name and (self.home is None or len(chain) > SETTINGS.deepest):
            why = "cannot be followed: write the deck to files, nested at most ten deep"
        if why or self.home is None:
            raise FileFormatError(f"{place}: INCLUDE {name[:100]!r} {why}")
        try:
            path = chain[-1].parent / name if chain else self.home / name
            inside = path.resolve().is_relative_to(self.home.resolve())
            own = path.resolve() in chain
        except (OSError, ValueError, RuntimeError) as error:
            raise FileFormatError(f"{place}: INCLUDE {name[:100]!r} cannot be followed: {error}") from None
        if not inside:
            raise FileFormatError(
                f"{place}: INCLUDE {name[:100]!r} lies outside the folder of the deck; copy the file there, and include the copy"
            )
        if own:
            raise FileFormatError(f"{place}: INCLUDE {name[:100]!r} includes itself; remove that line")
        return path


def raw_cards(lines: Iterable[tuple[DeckPlace, str]]) -> Iterator[RawCard]:
    """Join continuation lines and split cards into fields.

    Args:
        lines: Lines without comments, each with its place.

    Raises:
        FileFormatError: A continuation without a card, or under another name than its card's field 10.
    """
    card: tuple[str, DeckPlace] | None = None
    fields: list[str] = []
    places: list[DeckPlace] = []
    tag = ""
    for place, line in lines:
        first, data, next_tag = _split(line, place)
        if first and first[0] not in "+*":
            if card is not None:
                yield RawCard(card[0], tuple(fields), tuple(places), card[1])
            card, fields, places = (first.rstrip("* ").upper(), place), [], []
        elif card is None:
            raise FileFormatError(
                f"{place}: a continuation line stands here, but there is no card above it to continue"
            )
        elif tag and first.strip("+* ") and tag.strip("+* ") != first.strip("+* "):
            raise FileFormatError(
                f"{place}: continuation '{first}' follows a card that asks for '{tag}' in field 10; continuation lines must "
                "follow their card"
            )
        elif len(data) == 8:
            padding = -len(fields) % 8  # a single large-field line, continued by a small-field one
            fields += [""] * padding
            places += [place] * padding
        fields += data
        places += [place] * len(data)
        tag = next_tag
    if card is not None:
        yield RawCard(card[0], tuple(fields), tuple(places), card[1])


def _split(line: str, place: DeckPlace) -> tuple[str, list[str], str]:
    """First field, data fields (4 or 8) and last field of a line."""
    if "," in line:
        items = [item.strip() for item in line.split(",")]
        width = 4 if "*" in items[0] else 8
        first, data, rest = items[0], items[1 : width + 1], items[width + 1 :]
        if len(rest) > 1 or (rest and rest[0] and rest[0][0] not in "+*"):
            raise FileFormatError(
                f"{place}: {len(items) - 1} free fields stand on one line; {width} and the name of a continuation are the most"
            )
        return first, data + [""] * (width - len(data)), rest[0] if rest else ""
    first = line[:8].strip()
    width, size = (4, 16) if "*" in first else (8, 8)
    data = [line[8 + i * size : 8 + (i + 1) * size].strip() for i in range(width)]
    for text in data:
        if " " in text:
            raise FileFormatError(
                f"{place}: '{text}' stands in one field of {size} characters; the columns of this line are not those of "
                f"{'large' if width == 4 else 'small'} field"
            )
    return first, data, line[72:80].strip()


def card_lines(card: Card, form: Format = "large") -> list[str]:
    """The lines of one card.

    Args:
        card: The card.
        form: "small" (8 characters a field), "large" (16 where the card holds real numbers), or "free" (commas).

    Raises:
        UnknownNameError: No such form.
        ParameterError: A number does not fit, or is not finite.
    """
    if form not in get_args(Format):
        raise UnknownNameError("form of a deck", form, get_args(Format))
    fields = card.fields()
    while fields and fields[-1] is None:
        fields.pop()
    wide = form != "small" and any(isinstance(field, float) for field in fields)
    size, count, mark = (16, 4, "*") if wide else (8, 8, "+")
    texts = [_text(field, size) for field in fields] or [""]
    lines = []
    for start in range(0, len(texts), count):
        first = mark if start else card.name + ("*" if wide else "")
        row = texts[start : start + count]
        if form == "free":
            lines.append(",".join([first, *row]))
        else:
            lines.append((f"{first:<8}" + "".join(f"{text:>{size}}" for text in row)).rstrip())
    return lines


def _text(field: Field, size: int) -> str:
    if field is None:
        return ""
    if isinstance(field, str):
        return field
    return integer_text(field, size) if isinstance(field, int) else real_text(float(field), size)


def deck_text(cards: Iterable[Card | str], *, form: Format = "large") -> str:
    """The text of a deck; strings among the cards become comment lines.

    Args:
        cards: Cards and comments in order.
        form: As for `card_lines`.
    """
    lines: list[str] = []
    for item in cards:
        lines += (
            [f"$ {text}".rstrip() for text in item.splitlines()]
            if isinstance(item, str)
            else card_lines(item, form)
        )
    return "\n".join(lines) + "\n"


def write_deck(path: str | Path, cards: Iterable[Card | str], *, form: Format = "large") -> None:
    """Write a deck whole or not at all; arguments as of `deck_text`.

    Raises:
        OutputError: The file cannot be written.
    """
    write_text(path, deck_text(cards, form=form))
