"""``run_case --prune``: what the store holds that no run shows any more, and how much room it takes.

Runs are looked for in the folder that holds the store, those inside runs included; a link anywhere in a run counts.
What a run shows is taken only when it is asked for by name, what is being made never.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from matter.case.quantity import parse
from matter.errors import InputError
from matter.files import lock
from pipeline.case import stages
from pipeline.running import room
from pipeline.store import folder, store

_TRASH = ".trash"
_DEEP = 5
"""How deep in the folder of runs links are looked for: runs, their stages, runs inside runs with theirs."""


@dataclass(frozen=True)
class Held:
    """One folder of the store: what it takes [bytes], which runs show it, and since when it has not been changed [s
    since the epoch]."""

    name: str
    size: int
    runs: tuple[Path, ...]
    since: float
    done: bool


def held(out: Path) -> list[Held]:
    """Everything in the store of a folder of runs, the oldest first. Raises ``InputError`` where there is none."""
    store_folder = Path(out) / store.STORE
    if not store_folder.is_dir():
        raise InputError(f"{out} holds no store of stages ({store_folder})")
    shown = _shown(Path(out), store_folder)
    entries = []
    for one in store_folder.iterdir():
        if one.is_dir() and one.name.partition("-")[0] in stages.ORDER:
            last = max((path.stat().st_mtime for path in [one, *one.glob("*")] if path.exists()), default=0.0)
            entries.append(
                Held(
                    one.name,
                    folder.size_bytes(one),
                    tuple(sorted(shown.get(one.name, ()))),
                    last,
                    (one / folder.DONE).is_file(),
                )
            )
    return sorted(entries, key=lambda one: (one.since, one.name))


def _shown(out: Path, store_folder: Path) -> dict[str, set[Path]]:
    """Name in the store -> folders whose links lead there."""
    shown: dict[str, set[Path]] = {}
    root, top = store_folder.resolve(), len(out.resolve().parts)
    for where, folders, files in os.walk(out.resolve()):
        here = Path(where)
        if here == root or len(here.parts) - top >= _DEEP:
            folders.clear()
            continue
        for name in [*folders, *files]:
            path = here / name
            if path.is_symlink() and root in (target := path.resolve()).parents:
                shown.setdefault(target.relative_to(root).parts[0], set()).add(here)
    return shown


def chosen(entries: Iterable[Held], names: Iterable[str] = (), budget: float | None = None) -> list[Held]:
    """What is to go: of those that no run shows all, or the oldest until the store keeps to its ``budget`` [bytes]; or
    those asked for by name.

    Raises ``InputError`` for a name that is not there.
    """
    entries, names = list(entries), list(names)
    if names:
        known = {one.name: one for one in entries}
        for name in names:
            if name not in known:
                raise InputError(f"no {name!r} in the store{stages.nearest(name, list(known))}")
        return [known[name] for name in names]
    free = [one for one in entries if not one.runs]
    if budget is None:
        return free
    total, going = sum(one.size for one in entries), []
    for one in free:
        if total <= budget:
            break
        going.append(one)
        total -= one.size
    return going


def remove(out: Path, going: Iterable[Held]) -> list[str]:
    """Remove folders of the store; names of those that are being made, or that a run at work shows, and stay. What a
    kill leaves half removed goes the next time."""
    store_folder, busy = Path(out) / store.STORE, []
    for left in store_folder.glob(f"{_TRASH}-*"):
        shutil.rmtree(left, ignore_errors=True)
    for one in going:
        entry = one.name.removesuffix(".anew").removesuffix(".old")
        if any(lock.taken(place_of / "run.lock") for run in one.runs for place_of in (run, run.parent)):
            busy.append(one.name)
            continue
        try:
            with lock.held(store_folder / store.LOCKS / entry, entry):
                trash = store_folder / f"{_TRASH}-{one.name}"
                os.replace(store_folder / one.name, trash)
        except InputError:
            busy.append(one.name)
            continue
        shutil.rmtree(trash, ignore_errors=True)
    return busy


def size_of(text: str) -> float:
    """Bytes in a text such as ``20 GB``. Raises ``InputError``."""
    try:
        return parse(text, "bit") / 8.0
    except ValueError as reason:
        raise InputError(f"--budget: {reason}") from None


def table(entries: Iterable[Held], going: Iterable[Held]) -> str:
    """The store as a table: what takes how much, how many runs show it, what is to go."""
    entries, names = list(entries), {one.name for one in going}
    width = max([len(one.name) for one in entries], default=10)
    lines = [f"{'stage':<{width}}{'size':>10}{'runs':>6}"]
    for one in entries:
        words = f"{'' if one.done else '  unfinished'}{'  to be removed' if one.name in names else ''}"
        lines.append(f"{one.name:<{width}}{room.size(one.size):>10}{len(one.runs):>6}{words}")
    total, freed = (sum(one.size for one in some) for some in (entries, (one for one in entries if one.name in names)))
    return "\n".join(
        [
            *lines,
            f"{room.size(total)} in all, {room.size(freed)} to be freed ({len(names)} of {len(entries)})",
        ]
    )
