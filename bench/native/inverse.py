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

from bench.arrays import Array
from bench.native import quiet, untimed
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


@intrinsic
def _call_rne(typingctx, function, model, data, accelerated, result):
    """Call the C function ``void(const mjModel*, mjData*, int, mjtNum*)`` at integer `function`."""
    signature = types.void(types.int64, types.int64, types.int64, types.int32, types.int64)

    def codegen(context, builder, signature, args):
        pointer = ir.IntType(64)
        function_type = ir.FunctionType(ir.VoidType(), [pointer, pointer, ir.IntType(32), pointer])
        builder.call(builder.inttoptr(args[0], function_type.as_pointer()), args[1:])
        return context.get_dummy_value()

    return signature, codegen


@numba.njit(cache=True, nogil=True)
def _along(functions, rne, model, data, motion, state, found, result, diagonal, torque, inertia):
    q, v, a = motion
    qpos, qvel, qacc = state
    force, matrix = found
    for k in range(q.shape[0]):
        for j in range(q.shape[1]):
            qpos[j], qvel[j], qacc[j] = q[k, j], v[k, j], a[k, j]
        for i in range(functions.shape[0]):
            call(functions[i], model, data)
        if rne != 0:
            _call_rne(rne, model, data, np.int32(1), result)
        for j in range(q.shape[1]):
            torque[k, j] = force[j]
            inertia[k, j] = matrix[diagonal[j]]


@cache
def address(name: str) -> int:
    """Address of a function of MuJoCo's, for `call`."""
    return ctypes.cast(getattr(library(), name), ctypes.c_void_p).value or 0


STAGES = ("mj_kinematics", "mj_comPos", "mj_makeM", "mj_comVel")
"""What `mj_rne` takes, and the mass matrix."""


def _inertial(model: mujoco.MjModel) -> bool:
    """Whether a model holds inertia and gravity alone, so that Newton and Euler's recursion is all of its inverse dynamics."""
    forces = (
        model.dof_armature, model.actuator_armature, model.dof_damping, model.dof_dampingpoly, model.jnt_stiffness,
        model.jnt_stiffnesspoly,
    )  # fmt: skip
    free = bool(model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    still = not (model.ntendon or model.nflex or model.ngravcomp or model.opt.density or model.opt.viscosity)
    return free and still and not any(np.any(force) for force in forces)


@quiet()
@untimed()
def along(model: mujoco.MjModel, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """Torques and diagonals of the mass matrix (n, n_joints) along the motion (n, n_joints) of a model of hinges and slides.

    ``mj_inverse`` takes the recursion twice, factors the mass matrix and looks for contacts; of a model of inertia and gravity alone what
    is asked for is had in half its time, to the last digits.
    """
    data = mujoco.MjData(model)
    torque, inertia = np.empty(q.shape), np.empty(q.shape)
    # the mass matrix is stored by rows, its lower triangle, so that a row ends on the diagonal
    diagonal = np.array(model.M_rowadr, dtype=np.int64) + np.array(model.M_rownnz) - 1
    motion = tuple(np.ascontiguousarray(part, dtype=np.float64) for part in (q, v, a))
    stages, rne = (STAGES, address("mj_rne")) if _inertial(model) else (("mj_inverse",), 0)
    _along(
        np.array([address(name) for name in stages], dtype=np.int64), rne, model._address, data._address, motion,
        (data.qpos, data.qvel, data.qacc), (data.qfrc_inverse, data.M), data.qfrc_inverse.ctypes.data, diagonal, torque, inertia,
    )  # fmt: skip
    return torque, inertia
