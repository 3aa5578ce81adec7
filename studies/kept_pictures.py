"""Pictures of kept results made as small as they can be: a palette in place of full colour, then fewer points.

    python studies/kept_pictures.py [FOLDER or PNG] [--limit 150] [--dither]

Every PNG below FOLDER (``docs/results``) is written anew with 256 colours where that is smaller by a tenth at least.
One that is above the limit [kB] after that is made narrower step by step, never below 750 points. The palette keeps
rare colours, those of legends and colour bars; ``--dither`` is for a picture of a smooth field, whose faintest
colours it keeps apart. Look at them afterwards.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from matter.files import archive

RESULTS = Path(__file__).resolve().parents[1] / "docs" / "results"
LIMIT_KB, NARROWEST, SMALLER = 150.0, 750, 0.9


def forms(image: Any, dither: bool) -> Iterator[bytes]:
    """The picture as bytes, smaller and smaller."""
    from PIL import Image

    plain = image.convert("RGBA")
    white = Image.new("RGBA", plain.size, "white")
    plain = Image.alpha_composite(white, plain).convert("RGB")
    yield encoded(plain, dither)
    width = plain.width
    while (width := int(0.88 * width)) >= NARROWEST:
        size = (width, round(plain.height * width / plain.width))
        yield encoded(plain.resize(size, Image.Resampling.LANCZOS), dither)


def encoded(image: Any, dither: bool) -> bytes:
    """A PNG of an RGB image with a palette."""
    from PIL import Image

    held = io.BytesIO()
    few = (
        image.quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.FLOYDSTEINBERG)
        if dither
        else image.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    )
    few.save(held, format="PNG", optimize=True)
    return held.getvalue()


def shrink(path: Path, limit: float = LIMIT_KB, dither: bool = False) -> tuple[int, int]:
    """Write the picture anew where that pays; its bytes before and after."""
    from PIL import Image

    before = path.stat().st_size
    with Image.open(path) as image:
        image.load()
        if image.mode == "P" and before <= 1e3 * limit:
            return before, before
        best = None
        for form in forms(image, dither):
            best = form
            if len(form) <= 1e3 * limit:
                break
    if best is None or len(best) > (SMALLER if before <= 1e3 * limit else 1.0) * before:
        return before, before
    with archive.replacing(path) as temporary:
        Path(temporary).write_bytes(best)
    return before, len(best)


def main() -> int:
    """Shrink, and say what came of it; 1 where a picture stays above the limit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=RESULTS)
    parser.add_argument("--dither", action="store_true")
    parser.add_argument("--limit", type=float, default=LIMIT_KB, help="kB")
    given = parser.parse_args()
    large = 0
    for path in sorted(given.folder.rglob("*.png")) if given.folder.is_dir() else [given.folder]:
        before, after = shrink(path, given.limit, given.dither)
        if after != before or after > 1e3 * given.limit:
            print(f"{before / 1e3:8.0f} kB {after / 1e3:8.0f} kB  {path}")
        large += after > 1e3 * given.limit
    return int(large > 0)


if __name__ == "__main__":
    sys.exit(main())
