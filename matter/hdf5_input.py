"""HDF5 files that somebody else may have written or damaged: opened, and their arrays read, with one message whatever
is wrong in them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from matter.errors import InputError

if TYPE_CHECKING:
    import h5py

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
    """The file for reading. Raises ``InputError`` when it is missing, is not HDF5, or when anything in it cannot be
    read while it is open."""
    import h5py

    path = Path(path)
    if not path.is_file():
        raise InputError(f"no file {path}")
    try:
        with h5py.File(path, "r") as file:
            yield file
    except InputError:
        raise
    except _STUMBLES as reason:
        said = (str(reason).splitlines() or [type(reason).__name__])[0]
        raise InputError(f"{path} is not a readable HDF5 file ({said})") from None


def array(place: Any, name: str, numbers: bool = True) -> np.ndarray:
    """The array ``name`` of a file or group, of ``numbers`` or of anything.

    Raises ``InputError`` where it is a group, a link to another file, not of numbers, or larger than what is stored.
    """
    import h5py

    where = f"{place.file.filename}: {name}"
    if isinstance(place.get(name, getlink=True), h5py.ExternalLink):
        raise InputError(f"{where} is a link to another file, which is not followed")
    item = place[name]
    if not isinstance(item, h5py.Dataset):
        raise InputError(f"{where} is a group, and an array is needed")
    if numbers and item.dtype.kind not in "fiub":
        raise InputError(f"{where} holds no numbers ({item.dtype})")
    claimed, stored = item.size * item.dtype.itemsize, item.id.get_storage_size()
    if claimed > max(_SMALL, _SQUEEZED * stored):
        raise InputError(f"{where} claims to hold {claimed / 1e9:.3g} GB, and {stored / 1e6:.3g} MB are stored")
    return np.asarray(item[()])


def arrays(place: Any, deep: bool = False, numbers: bool = True) -> dict[str, np.ndarray]:
    """All arrays of a file or group by their names; ``deep``: those of its groups too, by their paths."""
    import h5py

    names: list[str] = []
    if deep:
        place.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    else:
        names = list(place)
    return {name: array(place, name, numbers) for name in names}
