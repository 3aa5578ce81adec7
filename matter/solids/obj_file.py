"""Wavefront OBJ files: vertices (``v x y z``) and faces (``f a b c ...``), all objects and groups as one surface.

A face names its corners by number, ``7``, ``7/1`` or ``7//3``, counted from 1, or backwards from where the face stands
(-1 is the vertex before it). Faces of more than three corners are cut into triangles from their first one. Normals,
textures, materials and lines are passed over, and no other file is opened for them.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from matter.errors import InputError


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3), in the file's unit, and triangles (m, 3). Raises ``InputError`` naming the line of a vertex or
    a face that is none."""
    vertices, triangles, count = array("d"), array("q"), 0
    for number, words in _statements(path):
        try:
            if words[0] == "v":
                _, x, y, z, *_ = words
                vertices.extend((float(x), float(y), float(z)))
                count += 1
            elif words[0] == "f":
                named = [int(word.partition("/")[0]) for word in words[1:]]
                corners = [k - 1 if k > 0 else count + k for k in named]
                if len(corners) < 3 or 0 in named or min(corners) < 0:
                    raise ValueError
                for two, three in pairwise(corners[1:]):
                    triangles.extend((corners[0], two, three))
        except (ValueError, OverflowError):
            kind = (
                "vertex: three numbers" if words[0] == "v" else f"face: three or more of the {count} vertices so far"
            )
            raise InputError(f"{path}, line {number}: {' '.join(words)[:60]!r} is no {kind}") from None
    return np.array(vertices).reshape(-1, 3), np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _statements(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Line and words of each statement; a line that ends with a backslash goes on in the next."""
    before = ""
    with open(path, encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            if line.rstrip().endswith("\\"):
                before += line.rstrip()[:-1] + " "
                continue
            words, before = (before + line).split(), ""
            if words:
                yield number, words
    if before.split():
        yield number, before.split()
