"""What lets neighbour lists be made and pair loops run over them in vector registers, where plain loops would go value
by value.

**Rows as columns.** A particle's values lie together in one row (two cache lines); a vectorised loop over its
neighbours wants each value of eight neighbours together. Copied value by value, this turning cost as much as the whole
pair loop (135 core-ms, 300,000 particles of 39 neighbours); eight rows at a time through shuffles in registers it
costs 42.

**Compression.** Of sixteen candidates those that passed a test are stored side by side at once.

Written as LLVM vectors, which every target lowers to what it has.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from matter.compilation.jit import law

LANES = 8
LINE = 8

_PAIRS = ([0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15])
_QUADS = ([0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15])
_HALVES = ([0, 1, 2, 3, 8, 9, 10, 11], [4, 5, 6, 7, 12, 13, 14, 15])


def _mask(lanes: list[int]) -> ir.Constant:
    return ir.Constant(ir.VectorType(ir.IntType(32), LANES), [ir.Constant(ir.IntType(32), lane) for lane in lanes])


def _transposed(builder, rows: list) -> list:
    """Eight vectors of eight, turned: exchange between neighbours, then pairs, then halves."""

    def exchanged(vectors, step, lanes):
        low, high = _mask(lanes[0]), _mask(lanes[1])
        result = list(vectors)
        for m in range(LANES):
            if not m & step:
                a, b = vectors[m], vectors[m + step]
                result[m], result[m + step] = builder.shuffle_vector(a, b, low), builder.shuffle_vector(a, b, high)
        return result

    return exchanged(exchanged(exchanged(rows, 1, _PAIRS), 2, _QUADS), 4, _HALVES)


def _columns(wide: int):
    """The code of ``columns`` for rows of ``wide`` values."""

    def codegen(context, builder, signature, args):
        arrays = [make_array(signature.args[a])(context, builder, value=args[a]) for a in (0, 1, 4)]
        table, listed, out = arrays
        width, out_stride = (cgutils.unpack_tuple(builder, array.shape)[1] for array in (table, out))
        integer = context.get_value_type(types.intp)
        vector = ir.VectorType(ir.DoubleType(), LANES)

        def at(data, offset):
            return builder.bitcast(builder.gep(data, [offset]), vector.as_pointer())

        entry = builder.add(args[2], args[3])
        starts = []
        for m in range(LANES):
            j = builder.load(builder.gep(listed.data, [builder.add(entry, ir.Constant(integer, m))]))
            starts.append(builder.mul(builder.sext(j, integer), width))
        for block in range(0, wide, LANES):
            read = [
                builder.load(at(table.data, builder.add(start, ir.Constant(integer, block))), align=8)
                for start in starts
            ]
            for c, column in enumerate(_transposed(builder, read)):
                address = builder.add(builder.mul(ir.Constant(integer, block + c), out_stride), args[3])
                builder.store(column, at(out.data, address), align=8)
        return context.get_dummy_value()

    return codegen


@law
def scratch_width(most):
    """Columns of a ``scratch`` for rows of at most ``most`` entries: a multiple of ``LANES``, so that no vector of a
    column lies in two cache lines."""
    return (most + LANES - 1) // LANES * LANES


@intrinsic
def columns(typingctx, rows, index, first, k, scratch):
    """scratch[c, k + m] = rows[index[first + k + m], c] for m = 0 ... 7 and all c.

    ``rows`` (n, 16) float64, C-ordered; ``index`` (entries,) int32, of which k to k + 7 past ``first`` are read;
    ``scratch`` (16, columns) float64.
    """
    return types.none(rows, index, types.intp, types.intp, scratch), _columns(16)


@intrinsic
def narrow_columns(typingctx, rows, index, first, k, scratch):
    """``columns`` of the first eight values of rows, into ``scratch`` (8, columns)."""
    return types.none(rows, index, types.intp, types.intp, scratch), _columns(8)


def _wide(builder, array, offset, lanes: int = LANES):
    """Place of ``lanes`` float64 values side by side, ``offset`` values into an array."""
    return builder.bitcast(builder.gep(array.data, [offset]), ir.VectorType(ir.DoubleType(), lanes).as_pointer())


def _starts(context, builder, table, index, k) -> list:
    """Offsets of the rows index[k] ... index[k + 7] of a C-ordered table."""
    integer = context.get_value_type(types.intp)
    width = cgutils.unpack_tuple(builder, table.shape)[1]
    offsets = []
    for m in range(LANES):
        j = builder.load(builder.gep(index.data, [builder.add(k, ir.Constant(integer, m))]))
        offsets.append(builder.mul(builder.sext(j, integer) if j.type.width < integer.width else j, width))
    return offsets


def _column_addresses(context, builder, scratch, first, k) -> list:
    """Offsets of scratch[first + c, k], c = 0 ... 7."""
    integer = context.get_value_type(types.intp)
    stride = cgutils.unpack_tuple(builder, scratch.shape)[1]
    return [builder.add(builder.mul(builder.add(first, ir.Constant(integer, c)), stride), k) for c in range(LANES)]


@intrinsic
def take_rows(typingctx, table, index, k, scratch, first):
    """scratch[first + c, k + m] = table[index[k + m], c] for m, c = 0 ... 7.

    ``table`` (n, 8 or more) and ``scratch`` float64, C-ordered; ``index`` integers, k to k + 7 are read.
    """

    def codegen(context, builder, signature, args):
        rows, listed, out = (make_array(signature.args[a])(context, builder, value=args[a]) for a in (0, 1, 3))
        read = [
            builder.load(_wide(builder, rows, start), align=8)
            for start in _starts(context, builder, rows, listed, args[2])
        ]
        for address, column in zip(
            _column_addresses(context, builder, out, args[4], args[2]), _transposed(builder, read)
        ):
            builder.store(column, _wide(builder, out, address), align=8)
        return context.get_dummy_value()

    return types.none(table, index, types.intp, scratch, types.intp), codegen


@intrinsic
def take_row_pairs(typingctx, table, one, two, k, scratch, first):
    """scratch[first + c, k + m] = table[one[k + m], c] and scratch[first + 4 + c, k + m] = table[two[k + m], c] for m
    = 0 ... 7, c = 0 ... 3.

    ``table`` (n, 4 or more) and ``scratch`` float64, C-ordered; ``one`` and ``two`` integers, k to k + 7 are read.
    """

    def codegen(context, builder, signature, args):
        rows, left, right, out = (make_array(signature.args[a])(context, builder, value=args[a]) for a in (0, 1, 2, 4))
        both = _mask(list(range(LANES)))
        read = []
        for a, b in zip(*(_starts(context, builder, rows, listed, args[3]) for listed in (left, right))):
            read.append(
                builder.shuffle_vector(
                    *(builder.load(_wide(builder, rows, start, 4), align=8) for start in (a, b)), both
                )
            )
        for address, column in zip(
            _column_addresses(context, builder, out, args[5], args[3]), _transposed(builder, read)
        ):
            builder.store(column, _wide(builder, out, address), align=8)
        return context.get_dummy_value()

    return types.none(table, one, two, types.intp, scratch, types.intp), codegen


@intrinsic
def put_rows(typingctx, scratch, first, k, index, table):
    """table[index[k + m], c] = scratch[first + c, k + m] for m, c = 0 ... 7: what ``take_rows`` took goes back."""

    def codegen(context, builder, signature, args):
        source, listed, rows = (make_array(signature.args[a])(context, builder, value=args[a]) for a in (0, 3, 4))
        read = [
            builder.load(_wide(builder, source, address), align=8)
            for address in _column_addresses(context, builder, source, args[1], args[2])
        ]
        for start, row in zip(_starts(context, builder, rows, listed, args[2]), _transposed(builder, read)):
            builder.store(row, _wide(builder, rows, start), align=8)
        return context.get_dummy_value()

    return types.none(scratch, types.intp, types.intp, index, table), codegen


@intrinsic
def add_rows(typingctx, scratch, first, k, index, table):
    """table[index[k + m], c] += scratch[first + c, k + m] for c = 0 ... 5, one m = 0 ... 7 after the other: an index
    may come more than once.

    ``table`` (n, 6 or more) and ``scratch`` float64, C-ordered; eight columns of ``scratch`` are read.
    """

    def codegen(context, builder, signature, args):
        source, listed, rows = (make_array(signature.args[a])(context, builder, value=args[a]) for a in (0, 3, 4))
        integer = context.get_value_type(types.intp)
        read = [
            builder.load(_wide(builder, source, address), align=8)
            for address in _column_addresses(context, builder, source, args[1], args[2])
        ]
        for start, row in zip(_starts(context, builder, rows, listed, args[2]), _transposed(builder, read)):
            for lanes in ([0, 1, 2, 3], [4, 5]):
                part = builder.shuffle_vector(
                    row,
                    row,
                    ir.Constant(
                        ir.VectorType(ir.IntType(32), len(lanes)),
                        [ir.Constant(ir.IntType(32), lane) for lane in lanes],
                    ),
                )
                address = _wide(builder, rows, builder.add(start, ir.Constant(integer, lanes[0])), len(lanes))
                builder.store(builder.fadd(builder.load(address, align=8), part), address, align=8)
        return context.get_dummy_value()

    return types.none(scratch, types.intp, types.intp, index, table), codegen


@intrinsic
def prefetch_row(typingctx, table, i):
    """Ask for the cache line in which table[i] begins, i of any integer type, not negative; ``table`` C-ordered."""

    def codegen(context, builder, signature, args):
        rows = make_array(signature.args[0])(context, builder, value=args[0])
        integer = context.get_value_type(types.intp)
        width = cgutils.unpack_tuple(builder, rows.shape)[1] if signature.args[0].ndim > 1 else ir.Constant(integer, 1)
        i = builder.sext(args[1], integer) if args[1].type.width < integer.width else args[1]
        byte, flag = ir.IntType(8).as_pointer(), ir.IntType(32)
        fetch = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), [byte, flag, flag, flag]), "llvm.prefetch.p0"
        )
        address = builder.bitcast(builder.gep(rows.data, [builder.mul(i, width)]), byte)
        builder.call(fetch, [address, *(ir.Constant(flag, value) for value in (0, 3, 1))])
        return context.get_dummy_value()

    return types.none(table, i), codegen


def aligned_zeros(shape: tuple[int, ...]) -> np.ndarray:
    """Zeros (float64) that begin on a cache line, so that rows of 8 lie in one line each."""
    count = int(np.prod(shape))
    room = np.zeros(count + LINE)
    skip = -(room.ctypes.data // room.itemsize) % LINE
    return room[skip : skip + count].reshape(shape)


def aligned(values: np.ndarray) -> np.ndarray:
    """A copy that begins on a cache line."""
    copy = aligned_zeros(values.shape)
    copy[:] = values
    return copy


WIDE = 16


@intrinsic
def append_passed(typingctx, candidate, passed, k, out, at):
    """Store those of candidate[k ... k + 15] whose ``passed`` is not 0 at out[at], out[at + 1], ...; how many there
    were.

    ``candidate`` and ``out`` int32, ``passed`` int8, all one-dimensional and contiguous. Up to 16 entries of ``out``
    past ``at`` are overwritten.
    """

    def codegen(context, builder, signature, args):
        source, test, target = (make_array(signature.args[a])(context, builder, value=args[a]) for a in (0, 1, 3))
        integer = context.get_value_type(types.intp)
        values, flags, bits = (ir.VectorType(ir.IntType(width), WIDE) for width in (32, 8, 1))

        def load(array, kind, size):
            return builder.load(builder.bitcast(builder.gep(array.data, [args[2]]), kind.as_pointer()), align=size)

        value, flag = load(source, values, 4), load(test, flags, 1)
        chosen = builder.icmp_unsigned("!=", flag, ir.Constant(flags, [0] * WIDE))
        kind = ir.FunctionType(values, [values, bits, values])
        compress = cgutils.get_or_insert_function(
            builder.module, kind, f"llvm.experimental.vector.compress.v{WIDE}i32"
        )
        packed = builder.call(compress, [value, chosen, ir.Constant(values, ir.Undefined)])
        builder.store(packed, builder.bitcast(builder.gep(target.data, [args[4]]), values.as_pointer()), align=4)
        word = builder.bitcast(chosen, ir.IntType(WIDE))
        return builder.zext(builder.ctpop(word), integer)

    return types.intp(candidate, passed, types.intp, out, types.intp), codegen


@intrinsic
def reserve(typingctx, cursor, many):
    """Add ``many`` to cursor[0] (int64) atomically; its value before."""

    def codegen(context, builder, signature, args):
        address = make_array(signature.args[0])(context, builder, value=args[0])
        return builder.atomic_rmw("add", address.data, args[1], "monotonic")

    return types.int64(cursor, types.int64), codegen
