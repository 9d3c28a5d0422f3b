"""Four numbers at once in a kernel, so that the source fixes the order of summation.

A dot product is fast only if it is summed in the lanes of a vector
unit. If the compiler chooses the order (fast-math), it changes with the
inlined code, and a kernel that was just compiled then differs in its
last bits from the same kernel loaded from disk. Here the lanes are
written out: lane l sums the terms l, l + 4, l + 8, ..., for any width
of the machine's registers.

Examples
--------
The terms are 3 k + 1 for k = 0 to 7, and lane l sums the terms l and l + 4.

>>> import numba
>>> import numpy as np
>>> @numba.njit
... def sums(a, b):
...     once = multiply_add(load(a, 0), load(b, 0), zeros())
...     both = multiply_add(load(a, 4), load(b, 4), once)
...     number = multiply_add(a[1], b[2] + 2.0, a[2])
...     return totals(once, both, add(both, once), load(a, 1)), total(both), number
>>> k, ones = np.arange(8.0), np.ones(8)
>>> sums(3.0 * k + 1.0, ones)
((22.0, 92.0, 114.0, 34.0), 92.0, 19.0)

The sums are rounded in this order: (0 + 1) + (2 + 3), and (0 + 2) + (1 + 3).

>>> rounded = sums(np.array([2.0**54, 1.0, -(2.0**54), 1.0, 0.0, 0.0, 0.0, 0.0]), ones)
>>> rounded[0][0], rounded[1]
(0.0, 2.0)
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, register_model

LANES = 4
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, LANES)


class _Lanes(types.Type):
    """Four floats in a vector register."""

    def __init__(self) -> None:
        super().__init__(name="Lanes4")


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


_lanes = _Lanes()


def _constant(value: float) -> ir.Constant:
    return ir.Constant(_VECTOR, [value] * LANES)


def _place(context: Any, builder: Any, kinds: Any, array: Any, index: Any) -> Any:
    """Return a pointer to four consecutive numbers. The index is not checked."""
    data = context.make_array(kinds[0])(context, builder, array).data
    index = context.cast(builder, index, kinds[1], types.intp)
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


@intrinsic
def zeros(typing_context: Any) -> Any:
    """Return four zeros."""
    return _lanes(), lambda context, builder, signature, values: _constant(0.0)


@intrinsic
def load(typing_context: Any, array: Any, index: Any) -> Any:
    """Load entries index to index + 3 of a contiguous float64 array."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, signature.args, *values)
        return builder.load(place, align=8)

    return _lanes(array, index), generate


@intrinsic
def multiply_add(typing_context: Any, first: Any, second: Any, total: Any) -> Any:
    """Compute first * second + total for numbers or lanes, rounded once if the machine can."""
    lanes = isinstance(total, _Lanes)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        given = _VECTOR if lanes else _DOUBLE
        kind = ir.FunctionType(given, [given] * 3)
        name = "llvm.fmuladd." + (f"v{LANES}f64" if lanes else "f64")
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), values)

    kind = _lanes if lanes else types.float64
    return kind(kind, kind, kind), generate


@intrinsic
def add(typing_context: Any, first: Any, second: Any) -> Any:
    """Add two vectors in every lane."""
    signature = _lanes(_lanes, _lanes)
    return signature, lambda context, builder, signature, values: builder.fadd(*values)


@intrinsic
def totals(typing_context: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the lane sums of four vectors, each (0 + 1) + (2 + 3), with half as many additions."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        def chosen(first: Any, second: Any, lanes: list[int]) -> Any:
            mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), lanes)
            return builder.shuffle_vector(first, second, mask)

        def halved(first: Any, second: Any) -> Any:
            even, odd = (chosen(first, second, lanes) for lanes in ([0, 4, 2, 6], [1, 5, 3, 7]))
            return builder.fadd(even, odd)

        low, high = halved(*values[:2]), halved(*values[2:])
        sums = builder.fadd(chosen(low, high, [0, 1, 4, 5]), chosen(low, high, [2, 3, 6, 7]))
        place = ir.IntType(32)
        sums_of_lanes = [builder.extract_element(sums, place(lane)) for lane in range(LANES)]
        return context.make_tuple(builder, signature.return_type, sums_of_lanes)

    return types.UniTuple(types.float64, 4)(a, b, c, d), generate


@intrinsic
def total(typing_context: Any, values: Any) -> Any:
    """Return the sum of the four lanes, (0 + 2) + (1 + 3)."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = ir.IntType(32)
        lanes = [builder.extract_element(values[0], place(lane)) for lane in range(LANES)]
        even, odd = builder.fadd(lanes[0], lanes[2]), builder.fadd(lanes[1], lanes[3])
        return builder.fadd(even, odd)

    return types.float64(_lanes), generate
