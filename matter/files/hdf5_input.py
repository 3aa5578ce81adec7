"""HDF5 files that somebody else may have written or damaged: opened, and their arrays read, with one message whatever
is wrong in them.

What a file holds is in the file: one that takes values from elsewhere (external links, external storage, virtual
datasets) could hand on any file of the reader's, and is refused when it is opened.
"""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from matter.errors import InputError

if TYPE_CHECKING:
    import h5py

_SUPERBLOCK, _HEAP = b"\x89HDF\r\n\x1a\n", b"GCOL\x01\0\0\0"
_HEAP_HEADER = 16
"""Bytes before the objects of a heap, and before the content of each."""
_SMALL = 2**26
"""Arrays of this many bytes may be made of anything."""
_SQUEEZED = 1100
"""What the filters of HDF5 can squeeze at most (deflate: 1032 to 1): an array that claims more than this over what is
stored is not there."""
# what h5py raises on damaged files, depending on where the damage is
_STUMBLES = (
    OSError,
    ValueError,
    RuntimeError,
    KeyError,
    TypeError,
    AttributeError,
    OverflowError,
    MemoryError,
    UnicodeError,
    NotImplementedError,
)


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """The file for reading. Raises ``InputError`` when it is missing, is not HDF5, refers to other files, or when
    anything in it cannot be read while it is open."""
    import h5py

    path = Path(path)
    if not path.is_file():
        raise InputError(f"no file {path}")
    _refuse_endless_heaps(path)
    try:
        with h5py.File(path, "r") as file:
            _refuse_other_files(file, path)
            yield file
    except InputError:
        raise
    except _STUMBLES as reason:
        said = (str(reason).splitlines() or [type(reason).__name__])[0]
        raise InputError(f"{path} is not a readable HDF5 file ({said})") from None


def _refuse_endless_heaps(path: Path) -> None:
    """Raise ``InputError`` for a file with a damaged heap of texts. The library steps from object to object by the
    sizes that these state, and stands still for ever at one of size zero (HDF5 1.14, format specification III.E)."""
    if path.stat().st_size < _HEAP_HEADER:
        return
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        wide = _width_of_lengths(data)
        start = data.find(_HEAP)
        while start >= 0:
            if not _walks_to_its_end(data, start, wide):
                raise InputError(f"{path} is not a readable HDF5 file (its heap of texts at byte {start} is damaged)")
            start = data.find(_HEAP, start + 1)


def _width_of_lengths(data: mmap.mmap) -> int:
    """Bytes in which the file states sizes, from its superblock; 8 where that cannot be made out."""
    start = data.find(_SUPERBLOCK)
    if start < 0 or start + 16 > len(data):
        return 8
    wide = data[start + (14 if data[start + 8] < 2 else 10)]
    return wide if wide in (2, 4, 8) else 8


def _walks_to_its_end(data: mmap.mmap, start: int, wide: int) -> bool:
    """Whether the sizes of the objects in the heap at ``start`` lead from each to the next, and out of it."""
    end = start + int.from_bytes(data[start + 8 : start + 8 + wide], "little")
    if end > len(data):
        return True  # the library refuses it
    at = start + _HEAP_HEADER
    while at + _HEAP_HEADER <= end:
        free, size = data[at : at + 2] == b"\0\0", int.from_bytes(data[at + 8 : at + 8 + wide], "little")
        step = size if free else _HEAP_HEADER + (size + 7) // 8 * 8
        if step < _HEAP_HEADER or at + step > end:
            return False
        at += step
    return True


def _refuse_other_files(file: h5py.File, path: Path) -> None:
    """Raise ``InputError`` for the first name in a file whose content stands in another one."""
    import h5py

    for name, item in _content(file):
        if item is None:
            fault = "is a link to another file"
        elif isinstance(item, h5py.Dataset) and item.is_virtual:
            fault = "is made of datasets of other files (virtual)"
        elif isinstance(item, h5py.Dataset) and item.external:
            fault = "has its values in another file (external storage)"
        else:
            continue
        raise InputError(f"{path}: {name[:200]} {fault}, which is not followed: copy its values into this file")


def _content(root: Any) -> Iterator[tuple[str, Any]]:
    """Path and object of every group and dataset below a file or group, each once, in the order of the names; None
    instead of the object for a link to another file. Links within the file are passed over, and so is what cannot be
    opened."""
    import h5py

    seen, stack = {root.id}, [("", root, iter(sorted(root)))]
    while stack:
        above, group, names = stack[-1]
        name = next(names, None)
        if name is None:
            stack.pop()
            continue
        kind = group.id.links.get_info(name.encode("utf-8", "surrogateescape")).type
        if kind == h5py.h5l.TYPE_SOFT:
            continue
        if kind != h5py.h5l.TYPE_HARD:
            yield above + name, None
            continue
        try:
            item = group[name]
            known = item.id in seen
            seen.add(item.id)
        except _STUMBLES:
            continue
        if not known:
            yield above + name, item
        if not known and isinstance(item, h5py.Group):
            stack.append((f"{above}{name}/", item, iter(sorted(item))))


def datasets(group: Any) -> dict[str, Any]:
    """Every dataset of a file or group and of its groups, by its path."""
    import h5py

    return {name: item for name, item in _content(group) if isinstance(item, h5py.Dataset)}


def array(group: Any, name: str, numbers: bool = True) -> np.ndarray:
    """The array ``name`` of a file or group, of ``numbers`` or of anything.

    Raises ``InputError`` where it is a group, not of numbers, or larger than what is stored.
    """
    import h5py

    where = f"{group.file.filename}: {name}"
    item = group[name]
    if not isinstance(item, h5py.Dataset):
        raise InputError(f"{where} is a group, and an array is needed")
    if numbers and item.dtype.kind not in "fiub":
        raise InputError(f"{where} holds no numbers ({item.dtype})")
    claimed, stored = item.size * item.dtype.itemsize, item.id.get_storage_size()
    if claimed > max(_SMALL, _SQUEEZED * stored):
        raise InputError(f"{where} claims to hold {claimed / 1e9:.3g} GB, and {stored / 1e6:.3g} MB are stored")
    return np.asarray(item[()])


def arrays(group: Any, deep: bool = False, numbers: bool = True) -> dict[str, np.ndarray]:
    """All arrays of a file or group by their names; ``deep``: those of its groups too, by their paths."""
    return {name: array(group, name, numbers) for name in (datasets(group) if deep else group)}
