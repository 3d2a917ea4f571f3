"""Mutations of documents and of bytes, all drawn from one generator."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np

RAW = {
    "@deep list": "[" * 100_000,
    "@deep table": '{"a":' * 100_000,
    "@long integer": "9" * 5_000,
    "@integer of 400 digits": "1" + "0" * 400,
    "@no number": "NaN",
    "@infinite": "-Infinity",
    "@overflow": "1e999",
    "@surrogate": '"\\ud800"',
}
"""JSON that no Python value is written as, by what stands for it in a tree."""

VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2, 0.5, -0.0, 1e-300, 5e-324, 1e308, -1e308, 2**63, 10**18, 10**300, 3.0,
    "", "x", "nan", "1e-3", "\x00", "\u202e", "\U0001f4a5", "../../etc", "9**9**9", "a" * 300, "line\nbreak",
    [], [1], [1, 2], ["a"], [[]], [None], [{}], {}, {"a": 1}, {"value": 1}, {"uniform": [1, 0]}, {"uniform": [0, 1]},
    {"choice": []}, {"shared": "nope"}, {"type": "harmonic", "frequency": 1.0}, {"type": []}, [0.0] * 2000, *RAW,
)  # fmt: skip


def mutated(document: Any, rng: np.random.Generator) -> str:
    """Text of a JSON document after one to three mutations of its tree, and in one of ten cases of its text."""
    tree = json.loads(json.dumps(document))
    for _ in range(int(rng.integers(1, 4))):
        tree = _changed(tree, rng)
    text = json.dumps(tree, ensure_ascii=bool(rng.random() < 0.5))
    for name, raw in RAW.items():
        text = text.replace(json.dumps(name), raw)
    if rng.random() < 0.1:
        text = _torn(text, rng)
    return text


def _places(node: Any, found: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    """(table or list, key or index) of every value in a tree."""
    for key, value in node.items() if isinstance(node, dict) else enumerate(node):
        found.append((node, key))
        if isinstance(value, dict | list):
            _places(value, found)
    return found


def _changed(tree: Any, rng: np.random.Generator) -> Any:
    places = _places(tree, []) if isinstance(tree, dict | list) else []
    if not places or rng.random() < 0.02:
        return _value(rng)
    node, key = places[int(rng.integers(len(places)))]
    action = ACTIONS[int(rng.integers(len(ACTIONS)))]
    action(node, key, rng, places)
    return tree


def _value(rng: np.random.Generator) -> Any:
    return json.loads(json.dumps(VALUES[int(rng.integers(len(VALUES)))]))


def _replace(node: Any, key: Any, rng: np.random.Generator, places: list) -> None:
    node[key] = _value(rng)


def _remove(node: Any, key: Any, rng: np.random.Generator, places: list) -> None:
    del node[key]


def _misspell(node: Any, key: Any, rng: np.random.Generator, places: list) -> None:
    if isinstance(node, dict) and key:
        at = int(rng.integers(len(key)))
        node[key[:at] + key[at + 1 :] + ("x" if rng.random() < 0.5 else "")] = node.pop(key)


def _capital(node: Any, key: Any, rng: np.random.Generator, places: list) -> None:
    if isinstance(node, dict):
        node[key.upper()] = node.pop(key)


def _insert(node: Any, key: Any, rng: np.random.Generator, places: list) -> None:
    if isinstance(node, dict):
        node[str(_value(rng))[:40]] = _value(rng)
    else:
        node.insert(key, _value(rng))


def _swap(node: Any, key: Any, rng: np.random.Generator, places: list) -> None:
    other, place = places[int(rng.integers(len(places)))]
    node[key] = json.loads(json.dumps(other[place]))


def _scale(node: Any, key: Any, rng: np.random.Generator, places: list) -> None:
    if isinstance(node[key], int | float) and not isinstance(node[key], bool):
        node[key] = node[key] * float(10.0 ** rng.integers(-12, 13)) * (-1.0 if rng.random() < 0.3 else 1.0)


Action = Callable[[Any, Any, np.random.Generator, list], None]
ACTIONS: tuple[Action, ...] = (
    _replace,
    _replace,
    _replace,
    _remove,
    _misspell,
    _capital,
    _insert,
    _swap,
    _scale,
)


def _torn(text: str, rng: np.random.Generator) -> str:
    at = int(rng.integers(len(text) + 1))
    if rng.random() < 0.5:
        return text[:at]
    return text[:at] + str(rng.choice(list('{}[],:"\\0-e\x00\ufeff'))) + text[at:]


def doubled(text: str, rng: np.random.Generator) -> str:
    """A JSON text with one of its keys written twice in the same table."""
    start = text.find("{", int(rng.integers(max(len(text), 1))))
    end = text.find(":", start)
    if start < 0 or end < 0 or '"' not in text[start:end]:
        return text
    return f"{text[: start + 1]}{text[start + 1 : end]}: 0, {text[start + 1 :]}"


def flipped(content: bytes, rng: np.random.Generator) -> bytes:
    """Bytes with some of them changed, cut off or repeated."""
    out = bytearray(content)
    for _ in range(int(rng.integers(1, 6))):
        if out:
            out[int(rng.integers(len(out)))] = int(rng.integers(256))
    if rng.random() < 0.2:
        out = out[: int(rng.integers(len(out) + 1))]
    return bytes(out)
