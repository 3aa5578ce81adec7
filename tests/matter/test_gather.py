"""Rows taken as columns and put back, against numpy's own indexing."""

import numpy as np
import pytest

from matter.compilation import gather
from matter.compilation.jit import kernel


@kernel
def _taken(table, index, scratch, first):
    for k in range(0, len(index), gather.LANES):
        gather.prefetch_row(table, index[k])
        gather.take_rows(table, index, k, scratch, first)


@kernel
def _pairs_taken(table, one, two, scratch, first):
    for k in range(0, len(one), gather.LANES):
        gather.take_row_pairs(table, one, two, k, scratch, first)


@kernel
def _put(scratch, first, index, table):
    for k in range(0, len(index), gather.LANES):
        gather.put_rows(scratch, first, k, index, table)


@kernel
def _added(scratch, first, index, table):
    for k in range(0, len(index), gather.LANES):
        gather.add_rows(scratch, first, k, index, table)


@pytest.mark.parametrize("kind", [np.int32, np.int64])
@pytest.mark.parametrize("width", [8, 9])
def test_rows_become_columns_and_go_back(kind, width):
    rng = np.random.default_rng(1)
    table, scratch = rng.normal(size=(50, width)), rng.normal(size=(12, 24))
    index = rng.permutation(50)[:16].astype(kind)
    before = scratch.copy()
    _taken(table, index, scratch, 3)
    assert np.array_equal(scratch[3:11, :16], table[index, :8].T)
    scratch[3:11, :16] = before[3:11, :16]
    assert np.array_equal(scratch, before)  # nothing else was written
    put = table.copy()
    _put(scratch, 3, index, put)
    table[index, :8] = before[3:11, :16].T
    assert np.array_equal(put, table)


def test_two_rows_of_four_share_eight_columns():
    rng = np.random.default_rng(2)
    table, scratch = rng.normal(size=(40, 4)), np.zeros((9, 16))
    one, two = (rng.integers(0, 40, 16).astype(np.int32) for _ in range(2))
    _pairs_taken(table, one, two, scratch, 1)
    assert np.array_equal(scratch[1:], np.concatenate([table[one].T, table[two].T]))


def test_what_comes_twice_is_added_twice():
    rng = np.random.default_rng(3)
    table, scratch = rng.normal(size=(5, 6)), rng.normal(size=(8, 16))
    index = rng.integers(0, 5, 16)
    wanted = table.copy()
    for k in range(16):
        wanted[index[k]] += scratch[:6, k]
    _added(scratch, 0, index, table)
    assert np.array_equal(table, wanted)


def test_an_aligned_table_begins_on_a_cache_line():
    for shape in ((3, 8), (1000, 9)):
        table = gather.aligned_zeros(shape)
        assert table.shape == shape and table.ctypes.data % 64 == 0 and table.flags.c_contiguous and not table.any()
    assert gather.aligned_zeros((0, 8)).shape == (0, 8)  # what is empty has no place of its own
    values = np.arange(24.0).reshape(3, 8)
    copy = gather.aligned(values)
    assert np.array_equal(copy, values) and copy.ctypes.data % 64 == 0 and not np.shares_memory(copy, values)
