"""The two compiled callbacks: passive forces of all elements, and the rates of their hidden states.

One pair of stateless C functions serves every model of the process: all that they need is read from the model they
are called with. They take no lock, allocate nothing and never touch Python, so that rollouts and batches run them on
any number of threads with bit-identical results.

Nothing that a model holds is trusted: a law is called only where the number has the token of this process beside it, and only
with addresses that lie within the model. Where they do not, all passive forces become NaN, rather than leave a force out.
"""

from __future__ import annotations

import numba
from numba import types

from bench.laws.base import MAX_COORDINATES
from bench.laws.calling import advance, call_kernel, load_int, load_int32, pointer_at, stack_array
from bench.native.encoding import HEADER, MAGIC, MAX_TERMS
from bench.native.table import (
    CAPACITY,
    D_ACT,
    D_ACT_DOT,
    D_CTRL,
    D_QFRC_PASSIVE,
    D_QPOS,
    D_QVEL,
    D_TIME,
    FIRST_LAW,
    FORCE,
    LAW_WORDS,
    M_ACTUATOR_ACTADR,
    M_ACTUATOR_DYNPRM,
    M_NA,
    M_NNUMERIC,
    M_NQ,
    M_NU,
    M_NUMERIC_ADR,
    M_NUMERIC_DATA,
    M_NUMERIC_SIZE,
    M_NV,
    RATE,
    TOKEN,
    words_address,
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
def _law(table, row):
    """Address of the three words of the row's law in the table; 0 where this process did not give it out."""
    if not 0.0 <= row[1] < CAPACITY:
        return 0
    words = table + 8 * (FIRST_LAW + LAW_WORDS * int(row[1]))
    if pointer_at(words + 8 * TOKEN)[0] != row[2]:
        return 0
    return words


@numba.njit(error_model="numpy", inline="always")
def _coordinates(row, size, nq, nv, table, model, qpos, qvel, ctrl, q, v):
    """Read the coordinates; returns whether everything that the row refers to lies within it and within the model."""
    if not 1.0 <= row[3] <= _LENGTH:
        return False
    at = HEADER
    for i in range(int(row[3])):
        if at + 2 > size or not 1.0 <= row[at + 1] <= MAX_TERMS:
            return False
        terms = int(row[at + 1])
        if at + 2 + 3 * terms > size:
            return False
        position = 0.0
        velocity = 0.0
        if row[at] == 0.0:
            for k in range(terms):
                term = at + 2 + 3 * k
                if not (0.0 <= row[term] < nq and 0.0 <= row[term + 1] < nv):
                    return False
                position += row[term + 2] * qpos[int(row[term])]
                velocity += row[term + 2] * qvel[int(row[term + 1])]
        else:
            if not 0.0 <= row[at + 2] < _word(table, model, M_NU):
                return False
            position = ctrl[int(row[at + 2])]
        q[i] = position
        v[i] = velocity
        at += 2 + 3 * terms
    if row[4] != 0.0 and not (
        row[4] > 0.0 and row[5] >= 0.0 and row[5] + row[4] <= _word(table, model, M_NA)
    ):
        return False
    return at <= row[6] <= size


@numba.njit(error_model="numpy", inline="always")
def _subtract_force(row, f, qfrc):
    at = HEADER
    for i in range(int(row[3])):
        terms = int(row[at + 1])
        if row[at] == 0.0:
            for k in range(terms):
                term = at + 2 + 3 * k
                qfrc[int(row[term + 1])] -= row[term + 2] * f[i]
        at += 2 + 3 * terms


@numba.cfunc(types.void(types.int64, types.int64), cache=True, error_model="numpy")
def passive(model, data):
    """Subtract the restoring forces of all elements of the model from `qfrc_passive`."""
    table = words_address()
    count = _word(table, model, M_NNUMERIC)
    if count == 0:
        return
    nq = float(_word(table, model, M_NQ))
    nv = float(_word(table, model, M_NV))
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
        size = load_int32(sizes + 4 * i)
        if size <= HEADER:
            continue
        row = advance(numbers, load_int32(addresses + 4 * i))
        if row[0] != MAGIC:
            continue
        law = _law(table, row)
        if law == 0 or not _coordinates(row, size, nq, nv, table, model, qpos, qvel, ctrl, q, v):
            for k in range(_word(table, model, M_NV)):  # let it show, rather than leave the force out
                qfrc[k] = NOT_A_NUMBER
            continue
        for k in range(int(row[3])):
            f[k] = 0.0
        states = advance(act, int(row[5])) if row[5] > 0.0 else act
        call_kernel(load_int(law + 8 * FORCE), time, q, v, states, advance(row, int(row[6])), f)
        _subtract_force(row, f, qfrc)


@numba.cfunc(types.float64(types.int64, types.int64, types.int32), cache=True, error_model="numpy")
def act_dyn(model, data, actuator):
    """Rates of the hidden states of the element behind a user actuator: written to `act_dot`, the first one returned."""
    table = words_address()
    prm = advance(_pointer(table, model, M_ACTUATOR_DYNPRM), DYNPRM * actuator)
    if prm[0] != MAGIC:
        return 0.0
    if not 0.0 <= prm[1] < _word(table, model, M_NNUMERIC):
        return NOT_A_NUMBER
    numeric = int(prm[1])
    size = load_int32(_word(table, model, M_NUMERIC_SIZE) + 4 * numeric)
    if size <= HEADER:
        return NOT_A_NUMBER
    addresses = _word(table, model, M_NUMERIC_ADR)
    row = advance(_pointer(table, model, M_NUMERIC_DATA), load_int32(addresses + 4 * numeric))
    first = load_int32(_word(table, model, M_ACTUATOR_ACTADR) + 4 * actuator)
    law = _law(table, row)
    if law == 0 or row[4] < 1.0 or row[5] != first:
        return NOT_A_NUMBER
    q = stack_array(_LENGTH)
    v = stack_array(_LENGTH)
    qpos = _pointer(table, data, D_QPOS)
    qvel = _pointer(table, data, D_QVEL)
    nq = float(_word(table, model, M_NQ))
    nv = float(_word(table, model, M_NV))
    ctrl = _pointer(table, data, D_CTRL)
    if not _coordinates(row, size, nq, nv, table, model, qpos, qvel, ctrl, q, v):
        return NOT_A_NUMBER
    act = _pointer(table, data, D_ACT)
    rates = advance(_pointer(table, data, D_ACT_DOT), first)
    time = pointer_at(data + load_int(table + 8 * D_TIME))[0]
    rate = load_int(law + 8 * RATE)
    if rate == 0:
        return NOT_A_NUMBER
    call_kernel(rate, time, q, v, advance(act, first), advance(row, int(row[6])), rates)
    return rates[0]


@numba.cfunc(types.float64(), cache=True, error_model="numpy")
def no_time():
    """A clock that stands still, see `bench.native.untimed`."""
    return 0.0
