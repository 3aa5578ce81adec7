"""The page of speeds, from the measurements that releases keep: ``benchmarks/history/<version>.json``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

HISTORY = Path(__file__).resolve().parents[2] / "benchmarks" / "history"
FIRST = """# Speed

How much processor time a piece of work takes here and in other programs. Each program does the same work in turns with
ours, on one thread each, on a machine that others use too; what counts is the median over the turns of the ratio of
CPU times (not of wall times), with the least and the largest in brackets. **Above 1: the other program takes so many
times as long.** Peers run at their own best: with the skin that suits them, and LIGGGHTS also by a deck of its own,
not only by the one that runs of bolide write. `python benchmarks/peers.py --record` measures all again (a quarter of
an hour)."""


def versions(folder: Path = HISTORY) -> list[dict[str, Any]]:
    """The kept measurements, the newest version first."""
    found = [json.loads(path.read_text()) for path in folder.glob("*.json")]
    return sorted(found, key=lambda one: [int(part) for part in one["version"].split(".") if part.isdigit()])[::-1]


def page(kept: list[dict[str, Any]]) -> str:
    """The page. Raises ``ValueError`` where nothing is kept."""
    if not kept:
        raise ValueError(f"nothing in {HISTORY}: python benchmarks/peers.py --record")
    newest = kept[0]
    parts = [FIRST, f"Version {newest['version']}, {newest['date']}: {newest['machine']}."]
    for name, suite in newest["suites"].items():
        sides = suite["sides"]
        parts += [
            f"## {suite['about'][:1].upper()}{suite['about'][1:]}",
            "\n".join(
                [
                    f"| program | {suite['unit']} per second of CPU time | its CPU time over ours | set-up |",
                    "|---|---|---|---|",
                    *(
                        f"| {side} | {amount(row['per_cpu_s'])} | {ratio(side, row)} | {row['note']} |"
                        for side, row in sides.items()
                    ),
                ]
            ),
            f"{suite['turns']} turns.",
        ]
        peers = [side for side in sides if side != "bolide"]
        if len(kept) > 1 and peers:
            rows = [
                f"| {one['version']} | " + " | ".join(found(one, name, side) for side in peers) + " |" for one in kept
            ]
            parts.append("\n".join([f"| version | {' | '.join(peers)} |", "|---|" + "---|" * len(peers), *rows]))
    return "\n\n".join(parts) + "\n"


def amount(value: float) -> str:
    """A rate in two digits."""
    return f"{value / 1e6:.2g} million" if value >= 1e6 else f"{value:,.0f}"


def ratio(side: str, row: dict[str, Any]) -> str:
    """A ratio with its range; nothing for ours."""
    return "" if side == "bolide" else f"**{row['ratio']:.2f}** ({row['ratio_from']:.2f} to {row['ratio_to']:.2f})"


def found(one: dict[str, Any], suite: str, side: str) -> str:
    """The ratio of an older version, where it was measured."""
    row = one["suites"].get(suite, {}).get("sides", {}).get(side)
    return f"{row['ratio']:.2f}" if row else "–"
