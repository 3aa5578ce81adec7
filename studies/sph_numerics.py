"""Both sets of numerics against exact solutions, row by row: former value, new value, limit, met before and now.

    python studies/sph_verification.py --out NEW
        # measures; the former set stands in docs/results/sph_verification
    python studies/sph_numerics.py [--former FILE] --new NEW/shocks.json [--out FILE]

Rows that only one of the two files holds are left out and counted.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from matter.files import archive

KEPT = Path(__file__).resolve().parents[1] / "docs" / "results" / "sph_verification" / "shocks.json"
SOD = 1.7522
"""Speed of the shock in Sod's tube."""


def shock(row: dict[str, Any]) -> str:
    """Errors of one column in per cent."""
    return ", ".join(f"{key} {100.0 * row[f'{key}_error']:+.2f}" for key in ("P", "rho", "u", "speed")) + " %"


def tube_limit(layers: float) -> float:
    """The largest L1 of the density in Sod's tube that is asked for."""
    return 0.04 if layers < 100 else 0.02


def rows(name: str, entry: dict[str, Any]) -> Iterator[tuple[str, str, str, bool | None]]:
    """What was measured, its value, its limit, and whether it is met (None: nothing is asked)."""
    kind = name.split("/")[0]
    if kind in ("pistons", "compaction"):
        limit = "1, 1, 2, 1 %" if kind == "pistons" else "2, 2, -, 2 %"
        yield f"{entry['case']}, piston {entry['piston_m_s']:g} m/s", shock(entry), limit, entry["met"]
        yield "... width of the front, supports", f"{entry['front_width_h']:.2f}", "", None
    elif kind == "sod":
        layers = float(name.split("/")[1].split()[0])
        most, value = (
            tube_limit(layers),
            f"L1 {100.0 * entry['L1_density']:.2f} %, speed {100.0 * (entry['shock_speed'] / SOD - 1.0):+.1f} %",
        )
        yield f"Sod's tube, {layers:g} layers", value, f"{100.0 * most:g} %", entry["L1_density"] < most
    elif kind == "quiet":
        yield (
            f"quiet end, pulse of {entry['sigma_spacings']:g} spacings",
            f"{100.0 * entry['returned']:.2f} %",
            "",
            None,
        )
    else:
        first = ""
        for one in entry["rows"]:
            first = one["what"] if not one["what"].startswith("...") else first
            what = (
                one["what"] if one["what"] == first else f"{first.split(':')[0]}, {one['what'].removeprefix('... ')}"
            )
            limit = (
                f"{one['wanted']:.4g} within {one['limit']:g}{' of it' if one['relative'] else ''}"
                if "wanted" in one
                else ""
            )
            yield what, f"{one['value']:.4g}", limit, one.get("met")


def table(former: dict[str, Any], new: dict[str, Any]) -> str:
    """The rows that both hold."""
    words = {True: "yes", False: "**no**", None: ""}
    text = ["| row | former | new | limit | met before | met now |", "|---" * 6 + "|"]
    lost = 0
    for name, entry in new.items():
        if name not in former:
            continue
        for (what, before, limit, was), (_, now, _, is_met) in zip(rows(name, former[name]), rows(name, entry)):
            lost += was is True and is_met is False
            text.append(f"| {what} | {before} | {now} | {limit} | {words[was]} | {words[is_met]} |")
    both = sum(name in former for name in new)
    return "\n".join(
        [
            *text,
            "",
            f"{both} measurements in both files ({len(former)} in the former, {len(new)} in the new one); rows lost: "
            f"{lost}.",
            "",
        ]
    )


def main() -> None:
    """Write or print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--former", type=Path, default=KEPT)
    parser.add_argument("--new", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    made = table(*(json.loads(path.read_text())["done"] for path in (options.former, options.new)))
    if options.out:
        archive.write_text(options.out, made)
    print(made)


if __name__ == "__main__":
    main()
