r"""Equations in plain text, as laws and effects state them for terminals and reports, set as LaTeX for the pages.

The notation is that of a calculator with words in between: ``f = Fc tanh(v / vr)``, ``z' = v - z / tau``, ``k (q - d) for q > d,
else 0``. A product binds tighter than the division behind it (``2 pi q / period``), a sign right behind a name is an index (``k+``),
a prime or ``dz/dt`` the derivative by time. What is no symbol is a word and is set upright.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection
from dataclasses import dataclass, field

NAMES = (
    "alpha beta gamma delta epsilon zeta eta theta kappa lambda mu nu xi pi rho sigma tau phi chi psi omega"
)
GREEK = set(NAMES.split())
STANDARD = {"tanh", "exp", "sin", "cos", "max", "min"}
"""Functions that LaTeX knows."""
OPERATORS = {"sgn", "sign", "sat", "ds", "dz"}
"""Functions of this field: sign, saturation, dead-space."""
THIN = tuple(f"\\{name}" for name in (*sorted(STANDARD), "operatorname"))
RELATIONS = {"=": "=", "<": "<", ">": ">", "<=": r"\le", ">=": r"\ge", ">>": r"\gg"}
CONDITIONS = ("for", "while", "beyond", "below", "else")
"""Words that begin the condition of a branch."""
SHORT_WORDS = {"in", "at", "of", "or", "is", "as", "an", "on", "by", "to", "no", "it", "if"}
"""English words of two letters; other pairs of letters are a symbol and its index."""
SYMBOL = re.compile("([A-Za-z]|" + "|".join(sorted(GREEK)) + r")([A-Za-z]|\d\w*)?")
"""A letter, and an index right behind it: `k`, `Fc`, `sigma0`, `k0theta`."""

TOKEN = re.compile(
    r"""\s*(?:
      (?P<rate>d(?P<of>[a-z])/dt\b) | (?P<number>\d+(?:\.\d+)?)
    | (?P<name>[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)?(?:-[A-Za-z]{2,})*)(?P<primes>'*)(?P<sign>[+-](?![\w(]))?
    | (?P<relation><=|>=|>>|=|<|>) | (?P<index>\[\d+\]) | (?P<unit>\[[^\]]+\]) | (?P<mark>[-+/^(),;:|…])
    )""",
    re.VERBOSE,
)


@dataclass(frozen=True)
class Token:
    """A token: its kind (a group of `TOKEN`), its text, and what stands right behind it."""

    kind: str
    text: str
    primes: int = 0
    sign: str = ""
    called: bool = False


def tokens(text: str) -> list[Token]:
    """The tokens of an equation.

    Raises:
        ValueError: It holds a character that the notation has not.
    """
    found, at = [], 0
    while text[at:].strip():
        match = TOKEN.match(text, at)
        if match is None:
            raise ValueError(f"'{text}': what is '{text[at:].strip()[0]}'?")
        at = match.end()
        kind = next(k for k in ("rate", "name", "number", "relation", "index", "unit", "mark") if match[k])
        said = match["of"] if kind == "rate" else match[kind]
        called = kind == "name" and text[at : at + 1] == "("
        found.append(Token(kind, said, len(match["primes"] or ""), match["sign"] or "", called))
    return found


def _letter(text: str) -> str:
    return (
        f"\\{text}"
        if text.lower() in GREEK
        else text
        if len(text) <= 1 or text.isdigit()
        else f"\\mathrm{{{text}}}"
    )


def symbol(token: Token, parameters: Collection[str]) -> str | None:
    """A name as a symbol with its index, derivative and sign; None where it is a word."""
    base, _, index = token.text.partition("_")
    split = SYMBOL.fullmatch(base)
    if base not in GREEK and (split is None or base in SHORT_WORDS):
        if token.text not in parameters:
            return None
    elif base not in GREEK and split is not None:
        base, index = split[1], ",".join(filter(None, (split[2], index)))
    if base == "d" and index and token.text not in parameters and "_" not in token.text:
        made, index = f"\\Delta {index}", ""  # dk, dJ: a small part of k, of J
    else:
        made = _letter(base)
    made = {0: made, 1: f"\\dot{{{made}}}", 2: f"\\ddot{{{made}}}"}[token.primes]
    inner = " ".join(_letter(part) for part in re.findall(r"[A-Za-z]+|\d+|,", index))
    return made + (f"_{{{inner}}}" if inner else "") + (f"^{{{token.sign}}}" if token.sign else "")


@dataclass
class Setter:
    """Sets a list of tokens, left to right.

    Attributes:
        rest: Tokens that are still to be set.
        parameters: Names that are symbols though they look like words.
        flat: Divisions by a stroke instead of a bar, for lines of text.
    """

    rest: list[Token]
    parameters: Collection[str]
    flat: bool
    inside: list[str] = field(default_factory=list)

    def _next(self, *texts: str) -> bool:
        return bool(self.rest) and self.rest[0].kind in {"mark", "relation"} and self.rest[0].text in texts

    def stream(self) -> str:
        """Everything up to the end or the closing bracket."""
        made = []
        while self.rest and not (self.inside and self._next(self.inside[-1])):
            if self.rest[0].kind == "relation":
                made.append(RELATIONS[self.rest.pop(0).text])
            elif self._next("+", "-"):
                gap = "\\ " if made and made[-1].endswith("}") and "\\text{" in made[-1] else ""
                made.append(gap + self.rest.pop(0).text)
            elif self._next(",", ";", ":", "…"):
                made.append({",": r",\ ", ";": r";\ ", ":": r":\ ", "…": r"\dots "}[self.rest.pop(0).text])
            elif self._factor_follows():
                made.append(self.term())
            else:
                raise ValueError(f"a symbol is missing before '{self.rest[0].text}'")
        return " ".join(made)

    def term(self) -> str:
        """A product, and what it is divided by."""
        upper = self.product()
        while self._next("/"):
            self.rest.pop(0)
            lower = self.factor()
            tall = not self.flat and "\\frac" not in upper + lower
            upper = f"\\frac{{{_bare(upper)}}}{{{_bare(lower)}}}" if tall else f"{upper} / {lower}"
            if self._factor_follows():
                upper += " " + self.product()
        return upper

    def _factor_follows(self) -> bool:
        if not self.rest:
            return False
        opening = self._next("(") or (self._next("|") and (not self.inside or self.inside[-1] != "|"))
        return opening or self.rest[0].kind in {"name", "number", "rate", "unit"}

    def product(self) -> str:
        """Factors beside each other; words among them as text."""
        made: list[str] = []
        words: list[str] = []
        while self._factor_follows():
            ahead = self.rest[0]
            if ahead.kind == "unit" or self._word():
                words.append(self.rest.pop(0).text)
                continue
            if words:
                made.append(_text(words))
                words = []
            made.append(self.factor())
        if words:
            made.append(_text(words))
        return _spaced(made)

    def _word(self) -> bool:
        """Whether the next token is a word; an 'a' before a word is one."""
        ahead = self.rest[0]
        if ahead.kind != "name" or ahead.called or ahead.text.startswith("sum_"):
            return False
        if ahead.text == "sum":
            return len(self.rest) == 1 or self.rest[1].kind != "name" or symbol(self.rest[1], ()) is None
        if ahead.text == "a" and len(self.rest) > 1 and self.rest[1].kind == "name":
            return symbol(self.rest[1], ()) is None and not self.rest[1].called
        return symbol(ahead, self.parameters) is None

    def factor(self) -> str:
        """A number, a symbol, a function or a bracket, to its power."""
        if self._next("-"):
            self.rest.pop(0)
            return f"-{self.factor()}"
        if self._next("(", "|"):
            made = self._bracket()
        elif not self._factor_follows():
            raise ValueError("a factor is missing behind an operator")
        else:
            token = self.rest.pop(0)
            made = (
                self._named(token)
                if token.kind == "name"
                else f"\\dot{{{token.text}}}"
                if token.kind == "rate"
                else token.text
            )
        if self.rest and self.rest[0].kind == "index":
            made += f"_{{{self.rest.pop(0).text[1:-1]}}}"
        if self._next("^"):
            made = f"{{{made}}}" if made.endswith(("rvert", "}")) and "left" in made[:5] else made
            self.rest.pop(0)
            flat, self.flat = self.flat, True
            made += f"^{{{_bare(self.factor())}}}"
            self.flat = flat
        return made

    def _named(self, token: Token) -> str:
        if token.text == "sum" or token.text.startswith("sum_"):
            index = token.text[4:]
            return "\\sum" + (f"_{{{index}}}" if index else "")
        if not token.called:
            return symbol(token, self.parameters) or f"\\text{{{token.text}}}"
        name = (
            f"\\{token.text}" if token.text in STANDARD
            else f"\\operatorname{{{token.text}}}" if token.text in OPERATORS
            else symbol(token, self.parameters) or f"\\operatorname{{{token.text}}}"
        )  # fmt: skip
        return name + self._bracket()

    def _bracket(self) -> str:
        opening = self.rest.pop(0).text
        self.inside.append({"(": ")", "|": "|"}[opening])
        within = self.stream()
        if not self.rest:
            raise ValueError(f"a '{opening}' is not closed")
        self.rest.pop(0)
        self.inside.pop()
        if opening == "|":
            return f"\\left\\lvert {within} \\right\\rvert"
        size = ("\\left", "\\right") if "\\frac" in within else ("", "")
        return f"{size[0]}({within}{size[1]})"


def _bare(text: str) -> str:
    """A bracket's inside, where one bracket is all there is."""
    for left, right in (("\\left(", "\\right)"), ("(", ")")):
        if text.startswith(left) and text.endswith(right):
            inner, depth = text[len(left) : -len(right)], 0
            for character in inner:
                depth += (character == "(") - (character == ")")
                if depth < 0:
                    return text
            return inner
    return text


def _text(words: list[str]) -> str:
    return f"\\text{{{' '.join(words)}}}"


def _spaced(factors: list[str]) -> str:
    """A product: a space beside words, a thin one beside functions and symbols of several letters."""
    made = factors[0] if factors else ""
    for before, factor in itertools.pairwise(factors):
        words = "\\text{" in (before[:6], factor[:6])
        thin = factor.startswith(THIN) or "\\mathrm" in (before[:7], factor[:7])
        made += ("\\ " if words else "\\," if thin else " ") + factor
    return made


def _clauses(found: list[Token]) -> list[tuple[str, list[Token]]]:
    """Parts between commas and semicolons that stand in no bracket, each with the mark before it."""
    made: list[tuple[str, list[Token]]] = [("", [])]
    depth = 0
    for token in found:
        if token.kind == "mark":
            depth += (token.text == "(") - (token.text == ")")
        if token.kind == "mark" and token.text in {",", ";"} and depth == 0:
            made.append((token.text, []))
        else:
            made[-1][1].append(token)
    return made


def _defines(clause: list[Token]) -> bool:
    """Whether a clause says what something is: a symbol or an expression, and the first relation is "="."""
    relation = next((t.text for t in clause if t.kind == "relation"), "")
    return relation == "=" and not (
        clause[0].kind == "name" and symbol(clause[0], ()) is None and not clause[0].called
    )


def _condition(clause: list[Token]) -> int | None:
    """Where the condition of a branch begins."""
    return next((k for k, t in enumerate(clause) if t.kind == "name" and t.text in CONDITIONS), None)


def is_equation(text: str) -> bool:
    """Whether a text relates or combines symbols; a plain sentence does not."""
    return any(t.kind in {"relation", "mark"} and t.text not in {",", ";", ":"} for t in tokens(text))


def _row(first: list[Token], more: list[tuple[str, list[Token]]], parameters: Collection[str]) -> str:
    """One definition with what belongs to it; branches in a brace."""

    def put(found: list[Token], flat: bool = False) -> str:
        return Setter(list(found), parameters, flat).stream()

    equals = next((k for k, t in enumerate(first) if t.text == "="), None)
    left, right = ("", first) if equals is None else (put(first[:equals]), first[equals + 1 :])
    branches = [right]
    while more and more[0][0] == "," and _condition(more[0][1]) is not None:
        branches.append(more.pop(0)[1])
    if len(branches) > 1 and _condition(right) is not None:
        rows = []
        for branch in branches:
            at = _condition(branch) or 0
            value, when = (branch[1:], branch[:1]) if branch[0].text == "else" else (branch[:at], branch[at:])
            rows.append(f"{put(value, True)} & {put(when, True)}")
        made = "\\begin{cases} " + r" \\ ".join(rows) + " \\end{cases}"
    else:
        made = r",\ ".join(put(branch) for branch in branches)
    tail = "".join(rf"{mark}\ {put(clause)}" for mark, clause in more)
    return f"{left} &{'' if equals is None else '='} {made}{tail}".strip()


def display(text: str, parameters: Collection[str] = ()) -> str:
    """An equation as displayed LaTeX, one definition a line.

    Args:
        text: The equation in plain text.
        parameters: Names that are symbols though they look like words.

    Raises:
        ValueError: The text is not in the notation.
    """
    rows: list[tuple[list[Token], list[tuple[str, list[Token]]]]] = []
    clauses = _clauses(tokens(text))
    if not any(_defines(clause) for _, clause in clauses):
        return Setter(tokens(text), parameters, flat=False).stream()
    for mark, clause in clauses:
        if not rows or _defines(clause):
            rows.append((clause, []))
        else:
            rows[-1][1].append((mark, clause))
    return "\\begin{split}\n" + " \\\\\n".join(_row(*row, parameters) for row in rows) + "\n\\end{split}"


def cell(text: str, parameters: Collection[str] = ()) -> str:
    """An equation as Markdown for a cell of a table, its parts set one by one, so that a line may break between them.

    Raises:
        ValueError: The text is not in the notation.
    """
    return "".join(
        f"{mark} ${Setter(clause, parameters, flat=True).stream()}$"
        for mark, clause in _clauses(tokens(text))
    ).strip()
