"""Ways in which input is wrong: mutated texts of cases, snapshots and JSON, drawn from a seed."""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

ODD = (
    '""', '"x"', '"-1 m"', '"1e-300 m"', '"1e300 m"', '"5e-324 m"', '"nan m"', '"inf s"', '"1 m 1 m"', '"m"',
    '"12 km/s"', '"3 parsec"', '"0 m"', '"1e9 kg"',
    "nan", "inf", "-inf", "0", "-1", "1e308", "5e-324", "-0.0", "99999999999999999999999", "true", "[]", "{}", "[[]]",
    "[1, 2]", '["a"]', "{ a = 1 }",
    "1979-05-27", "07:32:00", '"../../etc/passwd"', '"/dev/zero"', '"a/b"', "\"'; rm -rf /\"", '"\\u0000"',
    '"' + "y" * 5000 + '"', "[" * 60 + "]" * 60,
    '"\U0001f4a5"', '"$HOME"', '"{}"', '"%s"', "0x7fffffffffffffff",
)  # fmt: skip
_KEY = re.compile(r"^(\s*)([A-Za-z0-9_.\"-]+)(\s*=\s*)(.*)$")


def case_text(text: str, rng: random.Random) -> str:
    """A case with one to three mistakes."""
    for _ in range(rng.randint(1, 3)):
        text = rng.choice(
            (_value, _value, _value, _value, _renamed, _without, _twice, _header, _cut, _bytes, _swapped)
        )(text, rng)
    return text


def _lines(text: str) -> tuple[list[str], list[int]]:
    lines = text.split("\n")
    return lines, [k for k, line in enumerate(lines) if _KEY.match(line)] or [0]


def _value(text: str, rng: random.Random) -> str:
    lines, keyed = _lines(text)
    k = rng.choice(keyed)
    if found := _KEY.match(lines[k]):
        lines[k] = found[1] + found[2] + found[3] + rng.choice(ODD)
    return "\n".join(lines)


def _renamed(text: str, rng: random.Random) -> str:
    lines, keyed = _lines(text)
    k = rng.choice(keyed)
    if found := _KEY.match(lines[k]):
        name = list(found[2])
        name[rng.randrange(len(name))] = rng.choice("abcxyz_1.")
        lines[k] = found[1] + "".join(name) + found[3] + found[4]
    return "\n".join(lines)


def _without(text: str, rng: random.Random) -> str:
    lines, keyed = _lines(text)
    del lines[rng.choice(keyed)]
    return "\n".join(lines)


def _twice(text: str, rng: random.Random) -> str:
    lines, keyed = _lines(text)
    k = rng.choice(keyed)
    lines.insert(k, lines[k])
    return "\n".join(lines)


def _header(text: str, rng: random.Random) -> str:
    heads = re.findall(r"^\[.*\]$", text, re.M)
    if not heads:
        return text
    new = rng.choice(
        [
            "[x]",
            "[]",
            "[[sph]]",
            "[target.layers]",
            "[preset]",
            "[a.b.c.d.e.f]",
            "[dem.contact]",
            rng.choice(heads),
        ]
    )
    return text.replace(rng.choice(heads), new, 1)


def _cut(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(len(text) + 1)]


def _bytes(text: str, rng: random.Random) -> str:
    place = rng.randrange(len(text) + 1)
    return (
        text[:place]
        + rng.choice(["\x00", "\x1b", "\ufeff", '"', "'''", "[", "]", "=", "\n", "\\", "#", "é", "\udc80"])
        + text[place + rng.randint(0, 3) :]
    )


def _swapped(text: str, rng: random.Random) -> str:
    lines, keyed = _lines(text)
    a, b = rng.choice(keyed), rng.choice(keyed)
    one, two = _KEY.match(lines[a]), _KEY.match(lines[b])
    if one and two:
        lines[a], lines[b] = one[1] + one[2] + one[3] + two[4], two[1] + two[2] + two[3] + one[4]
    return "\n".join(lines)


# -- snapshots


def snapshot_file(path: Path, new: Path, rng: random.Random) -> str:
    """A snapshot with one thing wrong at ``new``; what it is."""
    shutil.copyfile(path, new)
    if rng.random() < 0.35:
        return _raw(new, rng)
    with h5py.File(new, "r+") as file:
        places: list[str] = []
        file.visit(places.append)
        return _wrong_content(file, places, rng)


def _raw(path: Path, rng: random.Random) -> str:
    """Bytes of the file flipped, cut or put in."""
    content = bytearray(path.read_bytes())
    how = rng.choice(("flip", "cut", "zeros", "head"))
    if how == "flip":
        for _ in range(rng.choice((1, 8, 200))):
            content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    elif how == "cut":
        del content[rng.randrange(len(content)) :]
    elif how == "zeros":
        place = rng.randrange(len(content))
        content[place : place + 512] = bytes(min(512, len(content) - place))
    else:
        content[: rng.randint(1, 64)] = b"x"
    path.write_bytes(bytes(content))
    return how


def _wrong_content(file: h5py.File, places: list[str], rng: random.Random) -> str:
    """A data set, group or attribute that is not what it should be."""
    place = rng.choice(places)
    here = file[place]
    if rng.random() < 0.3 and here.attrs:
        name = rng.choice(list(here.attrs))
        here.attrs[name] = rng.choice([np.nan, "x" * 70, -1, np.zeros(3), b"\xff\xfe", 1e308])
        return f"attribute {name} of {place}"
    if not isinstance(here, h5py.Dataset):
        del file[place]
        return f"{place} is missing"
    shape, kind = here.shape, here.dtype
    values: Any = here[()] if shape and kind.kind in "fiu" and here.size else None
    how = rng.choice(
        ("gone", "group", "nan", "huge", "shape", "kind", "one", "equal", "vast", "link", "empty", "text", "negative")
    )
    del file[place]
    if how == "gone" or values is None:
        return f"{place} is missing"
    made: dict[str, Callable[[], Any]] = {
        "group": lambda: file.create_group(place),
        "nan": lambda: file.create_dataset(place, data=_with(values, np.nan, rng)),
        "huge": lambda: file.create_dataset(place, data=_with(values, 1e300, rng)),
        "shape": lambda: file.create_dataset(place, data=values[: max(1, len(values) // 2)]),
        "kind": lambda: file.create_dataset(place, data=np.zeros(shape, dtype=[("a", "f8"), ("b", "i4")])),
        "one": lambda: file.create_dataset(place, data=3.0),
        "equal": lambda: file.create_dataset(place, data=np.zeros(shape)),
        "vast": lambda: file.create_dataset(
            place, shape=(10**11, *shape[1:]), dtype="f8", chunks=(1024, *shape[1:])
        ),  # 800 GB that take no place
        "link": lambda: file.__setitem__(place, h5py.ExternalLink("/etc/passwd", "/x")),
        "empty": lambda: file.create_dataset(place, shape=(0, *shape[1:]), dtype="f8"),
        "text": lambda: file.create_dataset(place, data=np.full(len(values), b"abc")),
        "negative": lambda: file.create_dataset(place, data=-np.abs(values)),
    }
    made[how]()
    return f"{place}: {how}"


def _with(values: np.ndarray, bad: float, rng: random.Random) -> np.ndarray:
    new = values.astype(float)
    new.reshape(-1)[rng.randrange(new.size)] = bad
    return new


# -- JSON

WRONG = ("null", "[]", "{}", "3", '"x"', "NaN", "1e999", "-1", "true", "[[[[]]]]", '{"value": "x"}', "[1, null]")


def json_text(text: str, rng: random.Random) -> str:
    """A JSON file with one thing wrong: cut, a byte changed, a value of another kind, a key renamed."""
    how = rng.randrange(5)
    if how == 0:
        return text[: rng.randrange(len(text) + 1)]
    if how == 1:
        place = rng.randrange(len(text))
        return text[:place] + rng.choice('x{}[]",:\x00') + text[place + 1 :]
    values = list(re.finditer(r"(?<=: )(\"[^\"]*\"|-?[0-9][^,\s\]}]*|true|false|null)", text))
    if how in (2, 3) and values:
        one = rng.choice(values)
        return text[: one.start()] + rng.choice(WRONG) + text[one.end() :]
    keys = list(re.finditer(r"\"([^\"]+)\"(?=: )", text))
    if keys:
        one = rng.choice(keys)
        return text[: one.start(1)] + "q" + text[one.end(1) :]
    return rng.choice(WRONG)
