"""The two compiled callbacks: passive forces of all elements, and the rates of their hidden states.

One pair of stateless C functions serves every model of the process: all that they need is read from the model they
are called with. They take no lock, allocate nothing and never touch Python, so that rollouts and batches run them on
any number of threads with bit-identical results.
"""

from __future__ import annotations

import numba
from numba import types

from bench.laws.base import MAX_COORDINATES
from bench.laws.calling import advance, call_kernel, load_int, load_int32, pointer_at, stack_array
from bench.native.encoding import HEADER, MAGIC
from bench.native.table import (
    D_ACT,
    D_ACT_DOT,
    D_CTRL,
    D_QFRC_PASSIVE,
    D_QPOS,
    D_QVEL,
    D_TIME,
    FIRST_LAW,
    M_ACTUATOR_ACTADR,
    M_ACTUATOR_DYNPRM,
    M_NNUMERIC,
    M_NUMERIC_ADR,
    M_NUMERIC_DATA,
    M_NUMERIC_SIZE,
    table_address,
)

NOT_A_NUMBER = float("nan")
DYNPRM = 10  # mjNDYN, parameters of an actuator's dynamics
_LENGTH = MAX_COORDINATES


@numba.njit(error_model="numpy", inline="always")
def _word(table, base, field):
    return load_int(base + load_int(table + 8 * field))


@numba.njit(error_model="numpy", inline="always")
def _pointer(table, base, field):
    return pointer_at(_word(table, base, field))


@numba.njit(error_model="numpy", inline="always")
def _coordinates(row, qpos, qvel, ctrl, q, v):
    at = HEADER
    for i in range(int(row[2])):
        terms = int(row[at + 1])
        position = 0.0
        velocity = 0.0
        if row[at] == 0.0:
            for k in range(terms):
                term = at + 2 + 3 * k
                position += row[term + 2] * qpos[int(row[term])]
                velocity += row[term + 2] * qvel[int(row[term + 1])]
        else:
            position = ctrl[int(row[at + 2])]
        q[i] = position
        v[i] = velocity
        at += 2 + 3 * terms


@numba.njit(error_model="numpy", inline="always")
def _subtract_force(row, f, qfrc):
    at = HEADER
    for i in range(int(row[2])):
        terms = int(row[at + 1])
        if row[at] == 0.0:
            for k in range(terms):
                term = at + 2 + 3 * k
                qfrc[int(row[term + 1])] -= row[term + 2] * f[i]
        at += 2 + 3 * terms


@numba.cfunc(types.void(types.int64, types.int64), cache=True, error_model="numpy")
def passive(model, data):
    """Subtract the restoring forces of all elements of the model from `qfrc_passive`."""
    table = table_address()
    count = _word(table, model, M_NNUMERIC)
    if count == 0:
        return
    addresses = _word(table, model, M_NUMERIC_ADR)
    sizes = _word(table, model, M_NUMERIC_SIZE)
    numbers = _pointer(table, model, M_NUMERIC_DATA)
    qpos = _pointer(table, data, D_QPOS)
    qvel = _pointer(table, data, D_QVEL)
    act = _pointer(table, data, D_ACT)
    ctrl = _pointer(table, data, D_CTRL)
    qfrc = _pointer(table, data, D_QFRC_PASSIVE)
    time = pointer_at(data + load_int(table + 8 * D_TIME))[0]
    q = stack_array(_LENGTH)
    v = stack_array(_LENGTH)
    f = stack_array(_LENGTH)
    for i in range(count):
        row = advance(numbers, load_int32(addresses + 4 * i))
        if load_int32(sizes + 4 * i) <= HEADER or row[0] != MAGIC:
            continue
        _coordinates(row, qpos, qvel, ctrl, q, v)
        n = int(row[2])
        law = int(row[1])
        if law < 0:  # never bound in this process: let it show, rather than leave the force out
            for k in range(n):
                f[k] = NOT_A_NUMBER
        else:
            for k in range(n):
                f[k] = 0.0
            force = load_int(table + 8 * (FIRST_LAW + 2 * law))
            states = advance(act, int(row[4])) if row[4] > 0.0 else act
            call_kernel(force, time, q, v, states, advance(row, int(row[5])), f)
        _subtract_force(row, f, qfrc)


@numba.cfunc(types.float64(types.int64, types.int64, types.int32), cache=True, error_model="numpy")
def act_dyn(model, data, actuator):
    """Rates of the hidden states of the element behind a user actuator: written to `act_dot`, the first one returned."""
    table = table_address()
    prm = advance(_pointer(table, model, M_ACTUATOR_DYNPRM), DYNPRM * actuator)
    if prm[0] != MAGIC:
        return 0.0
    addresses = _word(table, model, M_NUMERIC_ADR)
    row = advance(_pointer(table, model, M_NUMERIC_DATA), load_int32(addresses + 4 * int(prm[1])))
    act = _pointer(table, data, D_ACT)
    first = int(load_int32(_word(table, model, M_ACTUATOR_ACTADR) + 4 * actuator))
    rates = advance(_pointer(table, data, D_ACT_DOT), first)
    law = int(row[1])
    if law < 0:
        rates[0] = NOT_A_NUMBER
        return NOT_A_NUMBER
    q = stack_array(_LENGTH)
    v = stack_array(_LENGTH)
    qpos = _pointer(table, data, D_QPOS)
    qvel = _pointer(table, data, D_QVEL)
    _coordinates(row, qpos, qvel, _pointer(table, data, D_CTRL), q, v)
    time = pointer_at(data + load_int(table + 8 * D_TIME))[0]
    rate = load_int(table + 8 * (FIRST_LAW + 2 * law + 1))
    call_kernel(rate, time, q, v, advance(act, first), advance(row, int(row[5])), rates)
    return rates[0]


@numba.cfunc(types.float64(), cache=True, error_model="numpy")
def no_time():
    """A clock that stands still, see `bench.native.untimed`."""
    return 0.0
