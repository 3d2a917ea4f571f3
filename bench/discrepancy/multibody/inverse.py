"""MuJoCo's inverse dynamics along a motion in one compiled loop: the interpreter would take several times as long as MuJoCo itself."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import mujoco
import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic as _numba_intrinsic

from bench import native
from bench.arrays import Array
from bench.native.library import library

intrinsic: Any = _numba_intrinsic


@intrinsic
def call(typingctx, function, model, data):
    """Call the C function ``void(const mjModel*, mjData*)`` at integer `function`."""
    signature = types.void(types.int64, types.int64, types.int64)

    def codegen(context, builder, signature, args):
        function_type = ir.FunctionType(ir.VoidType(), [ir.IntType(64)] * 2)
        builder.call(builder.inttoptr(args[0], function_type.as_pointer()), args[1:])
        return context.get_dummy_value()

    return signature, codegen


@numba.njit(cache=True, nogil=True)
def _along(function, model, data, motion, state, found, diagonal, torque, inertia):
    q, v, a = motion
    qpos, qvel, qacc = state
    force, matrix = found
    for k in range(q.shape[0]):
        for j in range(q.shape[1]):
            qpos[j], qvel[j], qacc[j] = q[k, j], v[k, j], a[k, j]
        call(function, model, data)
        for j in range(q.shape[1]):
            torque[k, j] = force[j]
            inertia[k, j] = matrix[diagonal[j]]


@cache
def inverse_address() -> int:
    """Address of ``mj_inverse``, for `call`."""
    return ctypes.cast(library().mj_inverse, ctypes.c_void_p).value or 0


@native.quiet()
@native.untimed()
def along(model: mujoco.MjModel, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """Torques and diagonals of the mass matrix (n, n_joints) along the motion (n, n_joints) of a model of hinges and slides."""
    data = mujoco.MjData(model)
    torque, inertia = np.empty(q.shape), np.empty(q.shape)
    # the mass matrix is stored by rows, its lower triangle, so that a row ends on the diagonal
    diagonal = np.array(model.M_rowadr, dtype=np.int64) + np.array(model.M_rownnz) - 1
    motion = tuple(np.ascontiguousarray(part, dtype=np.float64) for part in (q, v, a))
    _along(
        inverse_address(), model._address, data._address, motion, (data.qpos, data.qvel, data.qacc), (data.qfrc_inverse, data.M),
        diagonal, torque, inertia,
    )  # fmt: skip
    return torque, inertia
