"""A movie of a run: the cross-section through the impact plane, shock stage and then grains, drawn off-screen frame by frame.

An animated GIF needs nothing but matplotlib; an MP4 is written where imageio and its ffmpeg are installed.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from crater import datum as datums
from crater import sections
from crater.plot import figure
from matter import archive, snapshot
from matter.errors import InputError
from matter.particles import Particles

FRAMES_PER_SECOND = 8
MOST_FRAMES = 120


def shots(run: Path) -> list[Path]:
    """The snapshots of both stages in the order of their time: shock stage up to the first of the grains, then the grains; at most ``MOST_FRAMES``."""
    shock, grains = snapshot.series(run / "2_sph"), snapshot.series(run / "5_dem")
    first = _time(grains[0]) if grains else np.inf
    chosen = [path for path in shock if _time(path) < first] + grains
    if not chosen:
        raise InputError(f"{run} holds no snapshots to make a movie of (2_sph/snap_*{snapshot.SUFFIX}, 5_dem/snap_*{snapshot.SUFFIX})")
    step = -(-len(chosen) // MOST_FRAMES)
    return chosen[::step]


def _time(path: Path) -> float:
    return float(snapshot.attributes(path).get("time", np.nan))


def frames(run: Path, half: float | None = None, colour: str = "material") -> Iterator[np.ndarray]:
    """Pictures (height, width, 3) of every snapshot, all at the scale ``half`` [m] (half of the width; default: 1.1 of the largest measured diameter).

    ``colour`` is ``material``, ``damage``, ``pressure`` or ``origin``; snapshots that lack the field are shown by material.
    """
    paths = shots(run)
    half = half or _half_width(run, paths)
    for path in paths:
        particles = snapshot.read(path)
        yield _frame(particles, half, _colouring(particles, colour, half), _time(path))


def _half_width(run: Path, paths: list[Path]) -> float:
    """1.1 of the largest diameter that the run's ``measures.json`` states [m]; without it, what holds nine tenths of the last snapshot."""
    file = run / "6_crater" / "measures.json"
    content = archive.read_json(file) if file.is_file() else {}
    cells = [content.get(phase, {}).get(name) for phase in ("transient", "final") for name in ("diameter_rim_m", "diameter_apparent_m")]
    sizes = [float(cell["value"]) for cell in cells if isinstance(cell, dict) and cell.get("value") is not None]
    return 1.1 * max(sizes) if sizes else float(np.quantile(np.abs(snapshot.read(paths[-1]).position[:, 0]), 0.9))


def _colouring(particles: Particles, colour: str, half: float) -> sections.Colouring | None:
    known = {
        "material": (None, "position"),
        "damage": (sections.damage(), "damage"),
        "pressure": (sections.pressure(), "pressure"),
        "origin": (sections.depth_of_origin(0.6 * half), "initial_position"),
    }
    if colour not in known:
        raise InputError(f"movie colour {colour!r} is not known: take {', '.join(known)}")
    colouring, needed = known[colour]
    return colouring if needed in particles else None


def _frame(particles: Particles, half: float, colouring: sections.Colouring | None, time: float) -> np.ndarray:
    radius = particles.attributes.get("target_radius_m")
    domain = particles.attributes.get("domain")
    if radius is None and isinstance(domain, dict):
        radius = domain.get("datum_radius_m")
    datum = datums.sphere(float(radius)) if radius is not None else datums.plane()
    seen = sections.view(datum, half, 0.5, 0.45)
    fig = figure(9.6, 5.4)
    fig.set_dpi(100)
    axis = fig.add_subplot()
    drawn = sections.draw(axis, particles, seen, colouring, edge="none")
    if colouring is not None:
        fig.colorbar(drawn, ax=axis, label=colouring.label, shrink=0.8)
    axis.set(xlabel=f"x, downrange [{seen.unit}]", ylabel=f"height over the summit of the datum [{seen.unit}]")
    axis.set_title(f"{'grains' if 'radius' in particles else 'SPH'}, {time / 60:.1f} min" if time >= 60.0 else f"{time:.3g} s", loc="left")
    fig.canvas.draw()
    return np.asarray(fig.canvas.buffer_rgba())[:, :, :3].copy()


def write(run: Path, path: Path, half: float | None = None, colour: str = "material") -> int:
    """Write the movie of a run (``.gif``, or ``.mp4`` where imageio-ffmpeg is installed); returns the number of frames.

    Raises ``InputError`` for a run without snapshots, an unknown colour, or an ending that cannot be written here.
    """
    path = Path(path)
    pictures = frames(Path(run), half, colour)
    if path.suffix == ".mp4":
        return _write_mp4(pictures, path)
    if path.suffix != ".gif":
        raise InputError(f"a movie is a .gif or an .mp4, not {path.name}")
    from PIL import Image

    images = [Image.fromarray(picture).quantize(64) for picture in pictures]
    with archive.replacing(path) as temporary:
        images[0].save(temporary, format="GIF", save_all=True, append_images=images[1:], duration=1000 // FRAMES_PER_SECOND, loop=0)
    return len(images)


def _write_mp4(pictures: Iterator[np.ndarray], path: Path) -> int:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError("an .mp4 needs the package imageio-ffmpeg (pip install imageio-ffmpeg); a .gif needs nothing more") from None
    count = 0
    writer = None
    for picture in pictures:
        if writer is None:
            height, width = picture.shape[:2]
            writer = imageio_ffmpeg.write_frames(str(path), (width, height), fps=FRAMES_PER_SECOND, macro_block_size=2)
            writer.send(None)
        writer.send(np.ascontiguousarray(picture))
        count += 1
    if writer is not None:
        writer.close()
    return count
