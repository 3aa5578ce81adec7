"""Settled beds are shared: a bed depends on the body and the grains, not on the impact, so runs of one ``--out`` build it once.

A finished bed is hard-linked into ``<out>/beds/<key>/``; the key is the hash of the stage's inputs and of the sources that built it.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from pathlib import Path

from matter import archive
from pipeline import folder, provenance, stages


def place(out: Path, inputs: str) -> Path:
    """Where the bed with these inputs is shared."""
    key = hashlib.sha256(f"{inputs} {provenance.source_key(stages.MODULES['bed'])}".encode()).hexdigest()
    return out / "beds" / key[:16]


def take(shared: Path, into: Path) -> bool:
    """Link a shared bed into a stage folder; False when there is none yet."""
    if not folder.record(shared / folder.DONE):
        return False
    _link_all(shared, into)
    return True


def give(made: Path, shared: Path, inputs: str) -> None:
    """Share a finished bed; the marker goes last, so that a bed is shared whole or not at all."""
    shutil.rmtree(shared, ignore_errors=True)
    shared.mkdir(parents=True)
    _link_all(made, shared)
    archive.write_text(shared / folder.DONE, f'{{"inputs_sha256": "{inputs}"}}')


def _link_all(source: Path, target: Path) -> None:
    for path in sorted(source.iterdir()):
        if not path.is_file() or path.name in (folder.DONE, folder.BEGUN):
            continue
        (target / path.name).unlink(missing_ok=True)
        try:
            os.link(path, target / path.name)
        except OSError:  # a file system without hard links
            shutil.copy2(path, target / path.name)
