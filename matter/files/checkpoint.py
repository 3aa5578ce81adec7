"""Rolling checkpoints: the whole state of a stage, the two newest kept, so that a killed run resumes bit for bit.

Each holds a checksum (BLAKE2b) over the names, types, shapes and bytes of all that it keeps: one that a disk has
damaged is passed over for the one before.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from matter import progress
from matter.errors import InputError
from matter.files import archive

_KEPT = 2
_SUM = "checksum"


class _Saved(dict[str, Any]):
    """What a checkpoint held; asking for more than that names the file instead of failing without a word."""

    def __init__(self, path: Path, held: Mapping[str, Any]) -> None:
        super().__init__(held)
        self.path = path

    def __missing__(self, name: str) -> Any:
        raise InputError(
            f"{self.path} was written by another version of the program (it has no '{name}'): finish the run with "
            f"that version, "
            f"or delete the folder {self.path.parent.name} to restart this stage"
        )


def under(name: str, state: Mapping[str, Any]) -> dict[str, Any]:
    """The state of one object, under its ``name`` in a checkpoint."""
    return {f"{name}/{key}": value for key, value in state.items()}


def arrays_and_numbers(state: Mapping[str, Any]) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The arrays of a state, and its numbers and texts, as ``save`` takes them."""
    arrays = {name: value for name, value in state.items() if isinstance(value, np.ndarray)}
    return arrays, {name: value for name, value in state.items() if name not in arrays}


class SavedState(Mapping[str, Any]):
    """Arrays and numbers of a checkpoint as one state; a name that neither has is looked up in the numbers, which
    raise."""

    def __init__(self, arrays: Mapping[str, np.ndarray], scalars: Mapping[str, Any]) -> None:
        self.arrays, self.scalars = arrays, scalars

    def __getitem__(self, key: str) -> Any:
        return self.arrays[key] if key in self.arrays else self.scalars[key]

    def __iter__(self) -> Iterator[str]:
        return iter((*self.arrays, *self.scalars))

    def __len__(self) -> int:
        return len(self.arrays) + len(self.scalars)


class Part:
    """What a checkpoint holds ``under`` a name."""

    def __init__(self, saved: Mapping[str, Any], name: str) -> None:
        self.saved, self.name = saved, name

    def __getitem__(self, key: str) -> Any:
        return self.saved[f"{self.name}/{key}"]

    def __contains__(self, key: str) -> bool:
        return f"{self.name}/{key}" in self.saved


State = Mapping[str, Any] | Part
"""What an object gives for a checkpoint, and takes from one."""


def existing(folder: Path) -> list[Path]:
    """The checkpoints in a folder, the oldest first."""
    return sorted(folder.glob("checkpoint_*.h5"))


def save(folder: Path, step: int, arrays: Mapping[str, np.ndarray], scalars: Mapping[str, Any]) -> Path:
    """Write the state at ``step``; older checkpoints beyond the two newest go.

    ``arrays`` hold every array that the stage needs to continue identically (derived state and contact history too),
    ``scalars`` every number and short text.
    """
    path = folder / f"checkpoint_{step:010d}.h5"
    numbers = {"step": step, **scalars}
    archive.write(path, arrays, {**numbers, _SUM: checksum(arrays, numbers)}, compress=False)
    for old in existing(folder)[:-_KEPT]:
        old.unlink(missing_ok=True)
    return path


def checksum(arrays: Mapping[str, np.ndarray], scalars: Mapping[str, Any]) -> str:
    """BLAKE2b, 128 bits, of all names, types, shapes and bytes, in the order of the names."""
    digest = hashlib.blake2b(digest_size=16)
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape} ".encode())
        digest.update(array.tobytes() if array.dtype.hasobject or not array.size else array.view(np.uint8).data)
    for name in sorted(scalars):
        value = np.asarray(archive.plain(scalars[name]))
        digest.update(f"{name} {value.dtype.str} {value.tolist()!r} ".encode())
    return digest.hexdigest()


def newest(folder: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]] | None:
    """Arrays and scalars of the newest sound checkpoint, or None; whoever listens to the progress is told of one that
    is damaged.

    Whoever asks them for a name that they lack gets an ``InputError``.
    """
    for path in reversed(existing(folder)):
        try:
            arrays, scalars = archive.read(path)
            written = scalars.pop(_SUM, None)
            if written == checksum(arrays, scalars):
                return _Saved(path, arrays), _Saved(path, scalars)
            fault = (
                "its content is not what was written" if written else "it has no checksum: an older version wrote it"
            )
        except (
            Exception
        ) as reason:  # whatever HDF5 makes of damaged bytes: a disk that filled up, a file cut short, a flipped bit
            fault = str(reason).partition("\n")[0] or type(reason).__name__
        progress.tell(
            f"{path} is damaged ({fault}): not continued from it, but from the checkpoint before it, or from the "
            f"beginning"
        )
    return None


def keep_last(folder: Path) -> None:
    """Of the checkpoints of a finished stage only the newest stays: its last stretch can be computed again from it."""
    for path in existing(folder)[:-1]:
        path.unlink(missing_ok=True)


def clear(folder: Path) -> None:
    """Remove the checkpoints of a stage."""
    for path in existing(folder):
        path.unlink(missing_ok=True)
