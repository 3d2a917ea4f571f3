"""Where MuJoCo keeps the fields that the callbacks read: byte offsets into mjModel and mjData.

The offsets are computed from `mujoco.introspect`, MuJoCo's own description of its structs, and checked against the
addresses of live arrays before the first callback is installed. They reach the compiled callbacks at run time, through
the process table, so that machine code cached under one MuJoCo version can never read another's fields.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import mujoco
import numpy as np
from mujoco.introspect import structs

from bench.errors import NativeError

TESTED_MUJOCO = ("4.0.0", "4.1.0")
"""Tested range: from the first version (included) to the second (excluded)."""

MODEL_SIZES = ("nq", "nv", "nu", "na", "nnumeric")
MODEL_FIELDS = (
    *MODEL_SIZES,
    "numeric_adr",
    "numeric_size",
    "numeric_data",
    "actuator_dynprm",
    "actuator_actadr",
)
DATA_FIELDS = ("time", "qpos", "qvel", "act", "ctrl", "qfrc_passive", "act_dot")

_SCALARS: dict[str, Any] = {
    "int": ctypes.c_int,
    "mjtSize": ctypes.c_int64,
    "mjtBool": ctypes.c_bool,
    "mjtNum": ctypes.c_double,
    "mjtByte": ctypes.c_ubyte,
    "float": ctypes.c_float,
    "double": ctypes.c_double,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "unsigned int": ctypes.c_uint,
    "char": ctypes.c_char,
}


def _ctype(declaration: Any) -> Any:
    kind = type(declaration).__name__
    if kind == "PointerType":
        return ctypes.c_void_p
    if kind == "ArrayType":
        inner = _ctype(declaration.inner_type)
        for extent in reversed(declaration.extents):
            inner = inner * extent
        return inner
    if kind in {"AnonymousStructDecl", "StructDecl"}:
        return _structure("anonymous", declaration.fields)
    name = declaration.name
    if name in _SCALARS:
        return _SCALARS[name]
    if name in structs.STRUCTS:
        return _structure(name, structs.STRUCTS[name].fields)
    if name.startswith("mjt"):  # the other mjt* types are enumerations
        return ctypes.c_int
    raise NativeError(
        f"MuJoCo {mujoco.__version__} declares a field of type '{name}', which the bench does not know"
    )


def _structure(name: str, fields: Any) -> type[ctypes.Structure]:
    members = [(field.name, _ctype(field.type)) for field in fields if hasattr(field, "name")]
    return type(name, (ctypes.Structure,), {"_fields_": members})


@cache
def offsets() -> dict[str, int]:
    """Byte offsets of `MODEL_FIELDS` (as "m.name") and `DATA_FIELDS` (as "d.name").

    Raises:
        NativeError: The MuJoCo version is outside the tested range, or a field does not lie where MuJoCo's own
            description says.
    """
    check_version(mujoco.__version__)
    model_struct = _structure("mjModel", structs.STRUCTS["mjModel"].fields)
    data_struct = _structure("mjData", structs.STRUCTS["mjData"].fields)
    table = {f"m.{name}": getattr(model_struct, name).offset for name in MODEL_FIELDS}
    table |= {f"d.{name}": getattr(data_struct, name).offset for name in DATA_FIELDS}
    _check_against_live_arrays(table)
    return table


def check_version(version: str) -> None:
    """Refuse a MuJoCo version outside the tested range.

    Raises:
        NativeError: With the version that came and the range that is tested.
    """
    number = tuple(int(part) for part in version.split(".")[:3] if part.isdigit())
    low, high = (tuple(int(part) for part in bound.split(".")) for bound in TESTED_MUJOCO)
    if not low <= number < high:
        raise NativeError(
            f"MuJoCo {version} is installed, but the native callbacks read MuJoCo's structs and are tested for "
            f"{TESTED_MUJOCO[0]} <= version < {TESTED_MUJOCO[1]} only; install one of these, for example "
            f"`pip install 'mujoco>={TESTED_MUJOCO[0]},<{TESTED_MUJOCO[1]}'`"
        )


_PROBE = """<mujoco><worldbody><body><joint name="j" type="slide"/><geom size="1" mass="1"/></body></worldbody>
<actuator><general joint="j" dyntype="user" actdim="2" gainprm="0"/></actuator>
<custom><numeric name="a" data="1 2 3"/><numeric name="b" data="4 5"/></custom></mujoco>"""


def _check_against_live_arrays(table: dict[str, int]) -> None:
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    data.time = 0.125

    def word(name: str) -> int:
        base = model._address if name.startswith("m.") else data._address
        return ctypes.c_int64.from_address(base + table[name]).value

    wrong = [
        name
        for owner, prefix, names in (
            (model, "m.", MODEL_FIELDS[len(MODEL_SIZES) :]),
            (data, "d.", DATA_FIELDS[1:]),
        )
        for name in (prefix + field for field in names)
        if word(name) != getattr(owner, name[2:]).ctypes.data
    ]
    wrong += [f"m.{name}" for name in MODEL_SIZES if word(f"m.{name}") != getattr(model, name)]
    if np.int64(word("d.time")).view(np.float64) != data.time:
        wrong.append("d.time")
    for array, dtype in (
        (model.numeric_adr, np.int32),
        (model.numeric_size, np.int32),
        (model.actuator_actadr, np.int32),
    ):
        if array.dtype != dtype:
            wrong.append(f"integer width {array.dtype}")
    if wrong:
        raise NativeError(
            f"MuJoCo {mujoco.__version__} keeps {', '.join(wrong)} elsewhere than its description says; "
            "the native callbacks will not be installed. Please report this with your platform."
        )
