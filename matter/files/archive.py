"""Plain arrays in HDF5 files that are either whole or absent: tables, height maps, checkpoints.

Snapshots of particles have their own module (``matter.files.snapshot``), built on this one.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError, Stopped
from matter.files import hdf5_input

FULL = (errno.ENOSPC, errno.EDQUOT)
STAGE_MARKS = ("done.json", "begun.json")
"""Files that say that a folder is a stage of a run."""
_SPARE = 1 << 18  # bytes beside the arrays


@contextmanager
def replacing(path: Path, size: int = 0) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; on success it replaces ``path`` in one step, on failure it is removed.

    Raises ``Stopped`` where the disk is full or has no room for ``size`` bytes (HDF5 does not survive a disk that
    fills up under it): what was there before is kept.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    full = Stopped(
        f"no space left on the disk for {path}: make room, the same command resumes from the last checkpoint"
    )
    if size and shutil.disk_usage(path.parent).free < size + _SPARE:
        raise full
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
        _sync_folder(path.parent)
    except (OSError, RuntimeError) as fault:  # HDF5 closes an unfinished file with a RuntimeError
        if getattr(fault, "errno", None) in FULL or os.strerror(errno.ENOSPC) in str(fault):
            raise full from None
        raise
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def replacing_hdf5(path: Path, size: int = 0) -> Iterator[Any]:
    """Yield a new ``h5py.File`` that replaces ``path`` when it is whole; as ``replacing``.

    Raises the ``OSError`` of a write that failed.
    """
    import h5py

    with replacing(path, size) as temporary, _Beneath(temporary) as beneath:
        with h5py.File(beneath, "w") as file:
            yield file
        if beneath.fault is not None:
            raise beneath.fault


class _Beneath:
    """The file under an HDF5 file, which never hears that a write failed: the library would raise again while it frees
    what it holds, and may end the process. The first ``fault`` is kept, and nothing is written after it."""

    def __init__(self, path: Path) -> None:
        self.file = open(path, "w+b", buffering=0)
        self.fault: OSError | None = None

    def __enter__(self) -> _Beneath:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):  # a quota may speak up only here; the caller's fsync would have raised it
            self.file.close()

    def write(self, data: Any) -> int:
        rest = memoryview(data).cast("B")
        length = len(rest)
        try:
            while len(rest) and self.fault is None:
                rest = rest[self.file.write(rest) :]
        except OSError as fault:
            self.fault = fault
        return length

    def read(self, size: int = -1) -> bytes:
        return self.file.read(size) or b""

    def readinto(self, buffer: Any) -> int:
        return self.file.readinto(buffer) or 0

    def seek(self, offset: int, whence: int = 0) -> int:
        return self.file.seek(offset, whence)

    def tell(self) -> int:
        return self.file.tell()

    def truncate(self, size: int | None = None) -> int:
        try:
            return self.file.truncate(size) if self.fault is None else size or 0
        except OSError as fault:
            self.fault = fault
            return size or 0

    def flush(self) -> None:
        """Nothing is held back."""


def _sync_folder(folder: Path) -> None:
    """The new name is on the disk too, so that a loss of power does not undo it; not every file system can."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def remove_unfinished(folder: Path, below: bool = True) -> None:
    """Remove the temporary files that a killed process left in a folder, and ``below`` it."""
    for path in (Path(folder).rglob if below else Path(folder).glob)(".*.part"):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file that is whole or absent."""
    with replacing(path) as temporary:
        temporary.write_text(text)


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file of plain numbers, whole or absent; what is not finite, which JSON does not know, becomes
    null."""
    write_text(path, json_text(content, indent=1))


def json_text(content: Any, **layout: Any) -> str:
    """JSON of plain numbers; what is not finite, which JSON does not know, becomes null."""
    return json.dumps(_plain(content), allow_nan=False, **layout)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(entry) for entry in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value


def read_json(path: Path, kind: type = dict) -> Any:
    """The content of a JSON file that a run left; ``kind`` is what it has to be, a table (``dict``) or a ``list``.

    Raises ``InputError`` that names the file when it is damaged; ``OSError`` when it cannot be read at all.
    """
    try:
        content = json.loads(Path(path).read_text())
    except ValueError as reason:  # not JSON, or not even text
        raise InputError(f"{path} is damaged, it is not valid JSON: {reason}") from None
    if not isinstance(content, kind):
        raise InputError(f"{path} is damaged: it should hold a JSON {'object' if kind is dict else 'array'}")
    return content


def check_folder(path: Path, option: str = "--out") -> Path:
    """``path``, a folder that may still have to be made. Raises ``InputError`` when it cannot be one, so that nobody
    learns it after the work, and where it lies in a stage of a run: what is there counts as the stage's result."""
    path = Path(path)
    for folder in (path.absolute(), *path.absolute().parents):
        if any((folder / mark).is_file() for mark in STAGE_MARKS):
            raise InputError(f"{option} {path}: {folder} is a stage of a run, in which nothing else is written")
    for folder in (path, *path.absolute().parents):
        if folder.exists():
            if not folder.is_dir():
                raise InputError(f"{option} {path}: {folder} is a file, and a folder is needed")
            if not os.access(folder, os.W_OK | os.X_OK):
                raise InputError(f"{option} {path}: {folder} is not writable")
            break
    return path


def check_file(path: Path, option: str = "--out") -> Path:
    """``path``, a file to write. Raises ``InputError`` when it cannot be one."""
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{option} {path} is a folder, and the name of a file is needed")
    check_folder(path.absolute().parent, f"{option} {path}: the folder")
    return path


def write(
    path: Path, arrays: Mapping[str, Any], attributes: Mapping[str, Any] | None = None, compress: bool = True
) -> None:
    """Write named arrays to an HDF5 file.

    ``arrays`` maps a dataset path (``"a"`` or ``"group/a"``) to an array or to ``(array, unit, meaning)``;
    ``attributes`` are stored on the file.
    """
    size = sum(np.asarray(entry[0] if isinstance(entry, tuple) else entry).nbytes for entry in arrays.values())
    with replacing_hdf5(path, size) as file:
        for name, entry in arrays.items():
            array, unit, meaning = entry if isinstance(entry, tuple) else (entry, None, None)
            array = np.asarray(array)
            options = (
                dict(compression="gzip", compression_opts=1, shuffle=True) if compress and array.size > 64 else {}
            )
            dataset = file.create_dataset(name, data=array, **options)
            if unit is not None:
                dataset.attrs["unit"] = unit
                dataset.attrs["meaning"] = meaning
        for name, value in (attributes or {}).items():
            file.attrs[name] = value


def read(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Read every dataset (by its path) and the attributes of an HDF5 file. Raises ``InputError`` when it is missing or
    damaged."""
    with hdf5_input.opened(path) as file:
        return hdf5_input.arrays(file, deep=True, numbers=False), {
            name: plain(value) for name, value in file.attrs.items()
        }


def plain(value: Any) -> Any:
    """A value of an HDF5 attribute as a plain Python one."""
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if isinstance(value, np.generic) else value
