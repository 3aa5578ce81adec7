"""A movie of a run: the cross-section through the impact plane, shock stage and then grains, drawn off-screen frame by
frame.

An animated GIF needs nothing but matplotlib; an MP4 is written where imageio-ffmpeg is installed. Every frame says its
stage and time and names its colours. Grains fill a part of the target only: what lies outside is drawn faded, as the
shock stage left it at the handoff.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from crater.drawing import sections
from crater.drawing.figure import figure
from crater.ground import datum as datums
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.particles import Particles
from matter.wording import drawing, readable

FRAMES_PER_SECOND = 8
MOST_FRAMES = 120
FIELDS = ("material", "damage", "pressure", "origin", "speed")
FADED = 0.4


def shots(run: Path) -> list[Path]:
    """The snapshots of both stages in the order of their time: shock stage up to the first of the grains, then the
    grains; at most ``MOST_FRAMES``.

    The first and the last state of the run are always among them.
    """
    shock, grains = _with_last(run / "2_sph"), _with_last(run / "5_dem")
    first = _time(grains[0]) if grains else np.inf
    chosen = [path for path in shock if _time(path) < first] + grains
    if not chosen:
        raise InputError(
            f"{run} holds no snapshots to make a movie of (2_sph/snap_*{snapshot.SUFFIX}, "
            f"5_dem/snap_*{snapshot.SUFFIX})"
        )
    if len(chosen) <= MOST_FRAMES:
        return chosen
    return [chosen[k] for k in np.unique(np.linspace(0, len(chosen) - 1, MOST_FRAMES).round().astype(int))]


def _with_last(folder: Path) -> list[Path]:
    """The numbered snapshots of a stage, and its last state where that is later."""
    paths, last = snapshot.series(folder), folder / f"last{snapshot.SUFFIX}"
    return paths + [last] if paths and last.is_file() and _time(last) > _time(paths[-1]) else paths


def _time(path: Path) -> float:
    return float(snapshot.attributes(path).get("time", np.nan))


@dataclass(frozen=True)
class _Film:
    """What all frames share: half of the width [m], the field, the clock's factor and unit, legend entries, what
    surrounds the grains, their bed."""

    half: float
    field: str
    clock: tuple[float, str]
    marks: list[Any]
    surroundings: Particles | None
    bed: Particles | None
    fastest: float


def frames(run: Path, half: float | None = None, colour: str = "material") -> Iterator[np.ndarray]:
    """Pictures (height, width, 3) of every snapshot, all at the scale ``half`` [m] (half of the width; default: 1.1 of
    the largest measured diameter).

    ``colour`` is one of ``FIELDS``; snapshots that lack the field are shown by material.
    """
    if colour not in FIELDS:
        raise InputError(f"movie colour {colour!r} is not known: take {', '.join(FIELDS)}")
    paths = shots(run)
    film = _film(run, paths, half or _half_width(run, paths), colour)
    for path in paths:
        yield _frame(snapshot.read(path), film, _time(path))


def _film(run: Path, paths: list[Path], half: float, colour: str) -> _Film:
    ends = [snapshot.read(path) for path in (paths[0], paths[-1])]
    grains = [path for path in paths if path.parent.name == "5_dem"]
    bed = run / "3_bed" / f"bed{snapshot.SUFFIX}"
    before = snapshot.read(bed, only=("identity", "position")) if colour == "origin" and bed.is_file() else None
    fastest = 0.0
    if colour == "speed":
        fastest = max(
            float(np.quantile(np.linalg.norm(p.velocity, axis=1), 0.99))
            for p in map(snapshot.read, paths[1::4] or paths)
            if "velocity" in p
        )
    around = _surroundings(snapshot.series(run / "2_sph"), grains[0]) if grains else None
    marks = sections.material_marks(ends + ([around] if around else []))
    return _Film(half, colour, readable.time_unit(_time(paths[-1])), marks, around, before, max(fastest, 1e-9))


def _surroundings(shock: list[Path], first: Path) -> Particles | None:
    """Matter of the shock stage outside the domain of the grains, as it was when the ``first`` grains began; None
    where that is not known."""
    domain = snapshot.attributes(first).get("domain")
    if not shock or not isinstance(domain, dict):
        return None
    start = _time(first)
    matter = snapshot.read(min(shock, key=lambda path: abs(_time(path) - start)))
    x = matter.position
    if "core_radius_m" in domain:
        distance = np.linalg.norm(x, axis=1)
        angle = np.arctan2(np.hypot(x[:, 0], x[:, 1]), x[:, 2])
        outside = (distance < domain["core_radius_m"]) | (
            (angle > domain["cone_half_angle_rad"]) & (distance < domain["datum_radius_m"])
        )
    elif "floor_m" in domain:
        outside = (x[:, 2] < domain["floor_m"]) | (
            (np.hypot(x[:, 0], x[:, 1]) > domain["radius_m"]) & (x[:, 2] < domain.get("datum_m", 0.0))
        )
    else:
        return None
    return matter.select(outside) if outside.any() else None


def _half_width(run: Path, paths: list[Path]) -> float:
    """1.1 of the largest diameter that the run's ``measures.json`` states [m]; without it, what holds nine tenths of
    the last snapshot."""
    file = run / "6_crater" / "measures.json"
    content = archive.read_json(file) if file.is_file() else {}
    cells = [
        content.get(phase, {}).get(name)
        for phase in ("transient", "final")
        for name in ("diameter_rim_m", "diameter_apparent_m")
    ]
    sizes = [float(cell["value"]) for cell in cells if isinstance(cell, dict) and cell.get("value") is not None]
    return 1.1 * max(sizes) if sizes else float(np.quantile(np.abs(snapshot.read(paths[-1]).position[:, 0]), 0.9))


def _colouring(particles: Particles, film: _Film) -> sections.Colouring | None:
    """How these particles are coloured; None: by material."""
    deepest, bed = 0.6 * film.half, film.bed
    if (
        film.field == "origin"
        and "initial_position" not in particles
        and bed is not None
        and {"identity"} <= set(bed) & set(particles)
    ):
        return sections.depth_of_origin(deepest, lambda grains: sections.bed_positions(grains, bed))
    known: dict[str, tuple[Callable[[], sections.Colouring], str]] = {
        "damage": (sections.damage, "damage"),
        "pressure": (sections.pressure, "pressure"),
        "origin": (lambda: sections.depth_of_origin(deepest), "initial_position"),
        "speed": (lambda: sections.speed(film.fastest), "velocity"),
    }
    make, needed = known.get(film.field, (sections.damage, "no field"))
    return make() if needed in particles else None


def _frame(particles: Particles, film: _Film, time: float) -> np.ndarray:
    radius = particles.attributes.get("target_radius_m")
    domain = particles.attributes.get("domain")
    if radius is None and isinstance(domain, dict):
        radius = domain.get("datum_radius_m")
    datum = datums.sphere(float(radius)) if radius is not None else datums.plane()
    seen, grains = sections.view(datum, film.half, 0.5, 0.45), "radius" in particles
    fig = figure(9.6, 5.4)
    fig.set_layout_engine("none")  # every frame alike, with a colour bar or without
    fig.set_dpi(100)
    axis, bar = fig.add_axes((0.085, 0.11, 0.79, 0.76)), fig.add_axes((0.9, 0.2, 0.018, 0.58))
    colouring = _colouring(particles, film)
    if grains and film.surroundings is not None:
        sections.draw_section(
            axis, film.surroundings, seen, _colouring(film.surroundings, film) if colouring else None, edge="none"
        ).set_alpha(FADED)
        fig.text(0.875, 0.025, "faded: outside the grains, as at the handoff", ha="right", fontsize=8, color="#55606c")
    drawn = sections.draw_section(axis, particles, seen, colouring, edge="none")
    bar.set_visible(colouring is not None)
    if colouring is not None:
        fig.colorbar(drawn, cax=bar, label=colouring.label)
    marks = film.marks if colouring is None else film.marks[-1:]
    fig.legend(
        handles=marks,
        loc="upper right",
        bbox_to_anchor=(0.88, 0.99),
        ncols=min(len(marks), 5),
        fontsize=9,
        frameon=False,
        columnspacing=1.0,
        handletextpad=0.3,
    )
    axis.set_xlabel(f"x, downrange [{seen.unit}]")
    axis.set_ylabel(f"height above datum [{seen.unit}]")
    factor, unit = film.clock
    fig.text(0.085, 0.945, f"{'grains' if grains else 'SPH'}, {time * factor:.1f} {unit}", fontsize=13, weight="bold")
    fig.canvas.draw()
    return np.asarray(fig.canvas.buffer_rgba())[:, :, :3].copy()


def movie_formats() -> tuple[str, ...]:
    """What a movie can be written as on this machine: a GIF always, an MP4 with imageio-ffmpeg."""
    return (".gif", ".mp4") if drawing.has("imageio_ffmpeg") else (".gif",)


def write(run: Path, path: Path | Sequence[Path], half: float | None = None, colour: str = "material") -> int:
    """Write the movie of a run to one file or several (``.gif``, or ``.mp4`` where imageio-ffmpeg is installed), drawn
    once; returns the number of frames.

    Raises ``InputError`` for a run without snapshots, an unknown colour, or an ending that cannot be written here.
    """
    drawing.require("a movie")
    paths = [Path(entry) for entry in ([path] if isinstance(path, (str, Path)) else path)]
    for entry in paths:
        if entry.suffix not in (".gif", ".mp4"):
            raise InputError(f"a movie is a .gif or an .mp4, not {entry.name}")
        if entry.suffix not in movie_formats():
            raise InputError(
                f"an .mp4 needs the package imageio-ffmpeg ({drawing.INSTALL}); a .gif needs matplotlib only"
            )
    count = 0
    with ExitStack() as stack:
        takers = [
            (_gif if entry.suffix == ".gif" else _mp4)(stack.enter_context(archive.replacing(entry)))
            for entry in paths
        ]
        for taker in takers:
            next(taker)
        for picture in frames(Path(run), half, colour):
            for taker in takers:
                taker.send(picture)
            count += 1
        for taker in takers:
            next(taker, None)  # None instead of a picture: the end
    return count


def _gif(path: Path) -> Generator[None, np.ndarray | None, None]:
    """Takes frames, and None at the end: an animated GIF of 96 colours."""
    from PIL import Image

    images = []
    while (picture := (yield)) is not None:
        # rare colours are kept: the legend's have to be those of the particles
        images.append(Image.fromarray(picture).quantize(96, method=Image.Quantize.MAXCOVERAGE))
    images[0].save(
        path, format="GIF", save_all=True, append_images=images[1:], duration=1000 // FRAMES_PER_SECOND, loop=0
    )


def _mp4(path: Path) -> Generator[None, np.ndarray | None, None]:
    """Takes frames, and None at the end: H.264 in an MP4 that browsers and slides play."""
    import imageio_ffmpeg

    writer = None
    try:
        while (picture := (yield)) is not None:
            if writer is None:
                size, options = picture.shape[1::-1], ["-f", "mp4", "-movflags", "+faststart"]
                writer = imageio_ffmpeg.write_frames(
                    str(path), size, fps=FRAMES_PER_SECOND, macro_block_size=2, output_params=options
                )
                writer.send(None)
            writer.send(np.ascontiguousarray(picture))
    finally:
        if writer is not None:
            writer.close()
