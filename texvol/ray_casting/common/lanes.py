"""Lanes: eight numbers in one vector, on which compiled code computes at once.

A kernel evaluates a medium at eight nodes of an interval, or at the eight corners of a cell, and one formula holds for
all eight. LLVM makes no vectors of a loop over them, because each store might change what the loop loads. The functions
below take lanes and numbers, mixed; so a formula in them and + - * / is compiled for either. In plain Python, lanes are
arrays of numpy.
"""

from __future__ import annotations

import operator
from math import factorial, log
from typing import Any, ClassVar

import numpy as np
from llvmlite import ir
from numba import float64
from numba.core.cgutils import get_or_insert_function
from numba.core.datamodel.models import PrimitiveModel
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, register_model

from texvol.ray_casting.common.compiling import compiled, config, types

LANES = 8
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, LANES)
_BITS = ir.VectorType(ir.IntType(64), LANES)
_FUSED = ("contract",)  # a product and a sum may be rounded once
_LARGEST = 700.0  # whose exponential is a normal number
_TO_WHOLE = 1.5 * 2.0**52  # a number of so few digits that none is behind the point
_HIGH = float(np.float32(log(2)))  # log 2 is the sum of the two; the first has so few digits that n _HIGH is exact
_LOW = -1.904654299957768e-09
# Over |x| < log(2) / 2 the next power adds x^14 / 14! = 4e-18.
_OVER_FACTORIALS = np.array([1 / factorial(k) for k in range(14)])


class _Type(types.Type):
    """The type of lanes, of numbers or of truth values."""

    def __init__(self, name, element):
        self.element = element
        super().__init__(name=name)


@register_model(_Type)
class _Model(PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, ir.VectorType(kind.element, LANES))


lanes, flags = _Type("Lanes", _DOUBLE), _Type("Flags", ir.IntType(1))


def _spread(builder, value):
    """Return a vector of a number, and a vector itself."""
    if isinstance(value.type, ir.VectorType):
        return value
    kind = ir.VectorType(value.type, LANES)
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), zeros)


def _register(function, result, emit):
    """Let compiled code apply an operator to lanes and numbers."""
    pairs = [(lanes, lanes), (lanes, float64), (float64, lanes)]
    template = type("_Cases", (ConcreteTemplate,), {"cases": [signature(result, *pair) for pair in pairs]})
    infer_global(function)(template)

    def lowered(context, builder, signature, arguments):
        return emit(builder, *(_spread(builder, each) for each in arguments))

    for pair in pairs:
        lower_builtin(function, *pair)(lowered)


_ARITHMETIC = {
    (operator.add, operator.iadd): ir.IRBuilder.fadd,
    (operator.sub, operator.isub): ir.IRBuilder.fsub,
    (operator.mul, operator.imul): ir.IRBuilder.fmul,
    (operator.truediv, operator.itruediv): ir.IRBuilder.fdiv,
}
for _operators, _emit in _ARITHMETIC.items():
    for _operator in _operators:
        _register(_operator, lanes, lambda builder, a, b, emit=_emit: emit(builder, a, b, flags=_FUSED))
for _operator, _sign in {operator.gt: ">", operator.lt: "<"}.items():
    _register(_operator, flags, lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b))


@infer_global(operator.and_)
class _And(ConcreteTemplate):
    cases: ClassVar = [signature(flags, flags, flags)]


@lower_builtin(operator.and_, flags, flags)
def _and(context, builder, signature, arguments):
    return builder.and_(*arguments)


def _widest(*kinds):
    return lanes if lanes in kinds else float64


def _cast(context, builder, signature, arguments, result):
    """Return arguments as numbers, or all as lanes if the result is."""
    wide = [
        value if kind in (lanes, flags) else context.cast(builder, value, kind, float64)
        for kind, value in zip(signature.args, arguments, strict=True)
    ]
    return [_spread(builder, value) for value in wide] if result == lanes else wide


def _extreme(sign):
    """Return an intrinsic: the second of two arguments if it is `sign` the first, else the first."""

    def typed(typing_context, a, b):
        result = _widest(a, b)

        def code(context, builder, signature, arguments):
            one, other = _cast(context, builder, signature, arguments, result)
            return builder.select(builder.fcmp_ordered(sign, other, one), other, one)

        return result(a, b), code

    return intrinsic(typed)


least, greatest = _extreme("<"), _extreme(">")


@intrinsic
def choice(typing_context, condition, a, b):
    """Return `a` where the condition holds, else `b`."""
    result = lanes if condition == flags else _widest(a, b)

    def code(context, builder, signature, arguments):
        one, other = _cast(context, builder, result(*signature.args[1:]), arguments[1:], result)
        return builder.select(arguments[0], one, other)

    return result(condition, a, b), code


def _function(name, *operands):
    """Return code that calls a function of LLVM for numbers or lanes."""

    def code(context, builder, signature, arguments):
        kind = _VECTOR if signature.return_type == lanes else _DOUBLE
        values = _cast(context, builder, signature, arguments, signature.return_type)
        full = f"llvm.{name}.{'v8f64' if kind == _VECTOR else 'f64'}"
        function = get_or_insert_function(builder.module, ir.FunctionType(kind, [kind] * len(values)), full)
        return builder.call(function, values)

    return code


@intrinsic
def root(typing_context, x):
    """Return the square root."""
    return _widest(x)(x), _function("sqrt")


@intrinsic
def power(typing_context, base, exponent):
    """Return a power."""
    return _widest(base, exponent)(base, exponent), _function("pow")


@intrinsic
def magnitude(typing_context, x):
    """Return the absolute value."""
    return _widest(x)(x), _function("fabs")


@intrinsic
def spread(typing_context, x):
    """Return a number in all lanes."""

    def code(context, builder, signature, arguments):
        return _cast(context, builder, signature, arguments, lanes)[0]

    return lanes(x), code


@intrinsic
def like(typing_context, other, x):
    """Return a number in all lanes if `other` is lanes, else the number."""

    def code(context, builder, signature, arguments):
        kinds = signature.return_type(signature.args[1])
        return _cast(context, builder, kinds, arguments[1:], signature.return_type)[0]

    return _widest(other)(other, x), code


@intrinsic
def loaded(typing_context, row):
    """Return the numbers of a contiguous array of eight."""

    def code(context, builder, signature, arguments):
        return builder.load(_address(context, builder, row, arguments[0]), align=8)

    return lanes(row), code


@intrinsic
def store(typing_context, numbers, row):
    """Write lanes to a contiguous array of eight."""

    def code(context, builder, signature, arguments):
        builder.store(arguments[0], _address(context, builder, row, arguments[1]), align=8)
        return context.get_dummy_value()

    return types.void(numbers, row), code


def _address(context, builder, kind, row):
    data = context.make_array(kind)(context, builder, value=row).data
    return builder.bitcast(data, _VECTOR.as_pointer())


@intrinsic
def lane(typing_context, numbers, k):
    """Return the number of one lane; a number itself."""

    def code(context, builder, signature, arguments):
        return builder.extract_element(*arguments) if numbers == lanes else arguments[0]

    return float64(numbers, k), code


@intrinsic
def with_lane(typing_context, numbers, k, x):
    """Return lanes of which one holds another number."""

    def code(context, builder, signature, arguments):
        vector, index, value = arguments
        return builder.insert_element(vector, value, index)

    return lanes(numbers, k, float64), code


@intrinsic
def shifted(typing_context, numbers):
    """Return lanes that hold the number of the next lane; the last one holds its own."""

    def code(context, builder, signature, arguments):
        order = [min(k + 1, LANES - 1) for k in range(LANES)]
        return _shuffled(builder, arguments[0], order)

    return lanes(numbers), code


def _shuffled(builder, vector, order):
    places = ir.Constant(ir.VectorType(ir.IntType(32), len(order)), order)
    return builder.shuffle_vector(vector, ir.Constant(vector.type, ir.Undefined), places)


def _reduced(builder, vector, combine):
    """Return all lanes combined: the first half with the second until one is left."""
    count = LANES
    while count > 1:
        count //= 2
        first, second = list(range(count)), list(range(count, 2 * count))
        vector = combine(_shuffled(builder, vector, first), _shuffled(builder, vector, second))
    return builder.extract_element(vector, ir.Constant(ir.IntType(32), 0))


@intrinsic
def sum_of(typing_context, numbers):
    """Return the sum of lanes."""

    def code(context, builder, signature, arguments):
        return _reduced(builder, arguments[0], builder.fadd)

    return float64(numbers), code


@intrinsic
def greatest_of(typing_context, numbers):
    """Return the greatest of lanes."""

    def code(context, builder, signature, arguments):
        return _reduced(builder, arguments[0], lambda a, b: builder.select(builder.fcmp_ordered(">", b, a), b, a))

    return float64(numbers), code


@intrinsic
def any_of(typing_context, conditions):
    """Return True if a condition holds in any lane."""

    def code(context, builder, signature, arguments):
        if conditions != flags:
            return arguments[0]
        bits = builder.bitcast(arguments[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(conditions), code


@intrinsic
def _power_of_two(typing_context, n):
    """Return 2^n of lanes that hold whole numbers from -1022 to 1023."""

    def code(context, builder, signature, arguments):
        # In doubles from 2^52 to 2^53 the lowest bits of the mantissa are a whole number, here the exponent's bits.
        moved = builder.fadd(arguments[0], _spread(builder, ir.Constant(_DOUBLE, 2.0**52 + 1023)))
        shift = ir.Constant(_BITS, [52] * LANES)
        return builder.bitcast(builder.shl(builder.bitcast(moved, _BITS), shift), _VECTOR)

    return lanes(n), code


@compiled
def transmitted(depth):
    """Return e^-depth of lanes; e^-700 beyond 700."""
    x = 0.0 - least(depth, _LARGEST)
    n = (x * (1 / log(2)) + _TO_WHOLE) - _TO_WHOLE
    rest = (x - n * _HIGH) - n * _LOW
    square = rest * rest
    even, odd = spread(_OVER_FACTORIALS[12]), spread(_OVER_FACTORIALS[13])
    for k in range(10, -1, -2):  # two chains, as each product waits for the one before it
        even, odd = even * square + _OVER_FACTORIALS[k], odd * square + _OVER_FACTORIALS[k + 1]
    return (even + rest * odd) * _power_of_two(n)


_IN_NUMPY: dict[str, Any] = {
    "least": np.minimum,
    "greatest": np.maximum,
    "choice": np.where,
    "root": np.sqrt,
    "power": np.power,
    "magnitude": np.abs,
    "sum_of": np.sum,
    "greatest_of": np.max,
    "any_of": np.any,
    "spread": lambda x: np.full(LANES, x),
    "like": lambda other, x: np.full(LANES, x) if np.ndim(other) else x,
    "loaded": np.array,
    "store": lambda numbers, row: np.copyto(row, numbers),
    "lane": lambda numbers, k: numbers[k] if np.ndim(numbers) else numbers,
    "with_lane": lambda numbers, k, x: np.where(np.arange(LANES) == k, x, numbers),
    "shifted": lambda numbers: np.append(numbers[1:], numbers[-1]),
    "transmitted": lambda depth: np.exp(-np.minimum(depth, _LARGEST)),
}
if config.DISABLE_JIT:  # type: ignore[attr-defined]
    globals().update(_IN_NUMPY)
