"""JSON values that cannot be changed, for the provenance a record carries."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any, NoReturn

import numpy as np

from bench.errors import RecordingError


class FrozenDict(dict[str, Any]):
    """A dict that refuses changes; still a dict, so that `json.dumps` and comparison work as ever."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError(
            "the meta of a recording cannot be changed; make a copy with recording.with_(meta={…})"
        )

    __setitem__ = __delitem__ = clear = pop = popitem = setdefault = update = __ior__ = _refuse

    def __reduce__(self) -> tuple[Any, ...]:  # the default would refill the copy item by item
        return FrozenDict, (dict(self),)


def frozen(value: Any, *, where: str = "meta") -> Any:
    """An unchangeable copy of a JSON value: mappings become `FrozenDict`, sequences tuples, NumPy numbers Python's.

    Args:
        value: The value.
        where: Its place, for the message.

    Raises:
        RecordingError: Not a JSON value, or a mapping with a key that is no text.
    """
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise RecordingError(f"{where} has the key {key!r}; keys of JSON objects are text")
        return FrozenDict({key: frozen(item, where=f"{where}['{key}']") for key, item in value.items()})
    if isinstance(value, list | tuple):
        return tuple(frozen(item, where=f"{where}[{i}]") for i, item in enumerate(value))
    raise RecordingError(
        f"{where} is a {type(value).__name__}; JSON values (text, numbers, booleans, lists, objects) are expected"
    )
