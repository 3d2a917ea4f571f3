"""Calling kernels by address from compiled loops, and the few pointer operations that needs.

One compiled loop then serves every law: it receives the addresses of the force and rate kernels as integers, so that
no loop is compiled once per law. An indirect call costs about 2 ns, against some 4 µs for a MuJoCo step.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic as _numba_intrinsic

intrinsic: Any = _numba_intrinsic  # numba hides the typing context from callers; type checkers do not know

_double = ir.DoubleType()
_double_pointer = _double.as_pointer()
_pointer = types.CPointer(types.float64)


@intrinsic
def call_kernel(typingctx, address, t, q, v, z, theta, out):
    """Call the law kernel at integer `address` with the C signature of `bench.laws.base`."""
    signature = types.void(types.int64, types.float64, _pointer, _pointer, _pointer, _pointer, _pointer)

    def codegen(context, builder, signature, args):
        function_type = ir.FunctionType(ir.VoidType(), [_double] + [_double_pointer] * 5)
        function = builder.inttoptr(args[0], function_type.as_pointer())
        builder.call(function, args[1:])
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def call_with_address(typingctx, function, address):
    """Call the C function ``void(void*)`` at integer `function`."""
    signature = types.void(types.int64, types.int64)

    def codegen(context, builder, signature, args):
        function_type = ir.FunctionType(ir.VoidType(), [ir.IntType(64)])
        builder.call(builder.inttoptr(args[0], function_type.as_pointer()), args[1:])
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def pointer_at(typingctx, address):
    """Turn an integer address into a pointer to float64."""
    signature = _pointer(types.int64)

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], _double_pointer)

    return signature, codegen


@intrinsic
def advance(typingctx, pointer, count):
    """Return `pointer` moved on by `count` float64."""
    signature = _pointer(_pointer, types.int64)

    def codegen(context, builder, signature, args):
        return builder.gep(args[0], [args[1]])

    return signature, codegen


@intrinsic
def stack_array(typingctx, length):
    """Reserve `length` (a literal) float64 on the stack, not initialised; return a pointer to them."""
    if not isinstance(length, types.IntegerLiteral):
        return None
    count = length.literal_value
    signature = _pointer(length)

    def codegen(context, builder, signature, args):
        block = cgutils.alloca_once(builder, ir.ArrayType(_double, count))
        return builder.bitcast(block, _double_pointer)

    return signature, codegen


@intrinsic
def load_int(typingctx, address):
    """Read the 64-bit integer at an address."""
    signature = types.int64(types.int64)

    def codegen(context, builder, signature, args):
        return builder.load(builder.inttoptr(args[0], ir.IntType(64).as_pointer()))

    return signature, codegen


@intrinsic
def load_int32(typingctx, address):
    """Read the 32-bit integer at an address, widened to 64 bits."""
    signature = types.int64(types.int64)

    def codegen(context, builder, signature, args):
        value = builder.load(builder.inttoptr(args[0], ir.IntType(32).as_pointer()))
        return builder.sext(value, ir.IntType(64))

    return signature, codegen


@intrinsic
def claim(typingctx, counter):
    """Take the next number of a counter, an int64 array of one, that several threads share: none gets the same."""
    if not isinstance(counter, types.Array) or counter.dtype != types.int64:
        return None

    def codegen(context, builder, signature, args):
        array = context.make_array(signature.args[0])(context, builder, args[0])
        return builder.atomic_rmw("add", array.data, context.get_constant(types.int64, 1), "monotonic")

    return types.int64(counter), codegen
