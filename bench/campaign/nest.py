"""Nests of tables and lists in which a distribution may stand for a number: signals and chains of a plan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from bench.campaign.distribution import Distribution, Quantity, Shared, Value

Nested = Any
"""A signal's or chain's dictionary in which a distribution may stand for a number."""


def as_entry(node: Nested) -> Any:
    """A quantity, or a nest of them, as in a plan."""
    if isinstance(node, Distribution | Shared):
        return node.to_dict()
    if isinstance(node, Mapping):
        return {key: as_entry(value) for key, value in node.items()}
    if isinstance(node, list | tuple):
        return [as_entry(value) for value in node]
    return node


def leaves(node: Nested, path: str) -> Iterator[tuple[str, Quantity]]:
    """(path, quantity) of the numbers and distributions in a nest; fixed names and lists of plain numbers are none."""
    if isinstance(node, Distribution | Shared) or (
        isinstance(node, int | float) and not isinstance(node, bool)
    ):
        yield path, node
    elif isinstance(node, Mapping):
        for key, value in node.items():
            yield from leaves(value, f"{path}/{key}")
    elif isinstance(node, list | tuple) and not all(isinstance(value, int | float) for value in node):
        for index, value in enumerate(node):
            yield from leaves(value, f"{path}/{index}")


def filled(node: Nested, path: str, values: Mapping[str, Value]) -> Any:
    """The nest with the values drawn in the places of its distributions."""
    if isinstance(node, Distribution | Shared):
        return values[path]
    if isinstance(node, Mapping):
        return {key: filled(value, f"{path}/{key}", values) for key, value in node.items()}
    if isinstance(node, list | tuple):
        return [filled(value, f"{path}/{index}", values) for index, value in enumerate(node)]
    return node
