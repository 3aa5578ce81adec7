"""Measures of a crater: diameters, depths, rim, volume, each with an error made of azimuth, resolution, datum and
method in quadrature.

Definitions (Melosh 1989; Turtle et al. 2005; Robbins et al. 2018): apparent diameter: twice the distance at which the
wall meets the datum (of equal area where the crater is an ellipse); rim diameter: twice the distance of the crest;
depth: datum to floor; rim-to-floor depth: crest to floor; volume: between datum and ground inside the apparent
diameter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from crater.ground import cloud as clouds
from crater.ground import far_field, locate, surface
from crater.ground.datum import Datum, of_frame
from crater.ground.radial_profile import Profile, Relief, closed, profile_of, ring_mean
from crater.ground.shape import Ruler, harmonics, make_crest_finder, make_ruler, sector_radii, shape_of
from crater.measures import forms, quantities
from crater.measures.quantities import Hollow
from crater.measures.uncertainty import Quantity, quantity
from matter.geometry import frame
from matter.particles import Particles
from matter.wording import readable
from matter.wording.crater_measures import TABLE, UNITS

SOURCES = ("Melosh1989", "Turtle2005", "Robbins2018")

BOOTSTRAPS = 200
CLOSED_RIM = 0.75
"""Fraction of sectors that must stand above the datum outside the crater for a rim to be called closed."""
NO_LEVEL = 0.2
"""Where there is no hollow, the ground outside this fraction of the reach is its far field."""
NO_HOLLOW = 0.05
"""Where no hollow was found yet, the datum is fitted to the ground as if one of this fraction of the reach were
there."""
SHALLOWEST = 0.5
"""A hollow shallower than this many spacings has no diameter."""


@dataclass(frozen=True)
class Measures:
    """Named ``quantities`` of one crater, its ``profile``, the ``datum`` (axis through the crater's centre) and the
    ``ground``."""

    quantities: dict[str, Quantity]
    profile: Profile
    datum: Datum
    ground: Relief
    notes: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Quantity:
        return self.quantities[name]

    def as_dict(self) -> dict:
        """JSON-ready."""
        return {**{name: q.as_dict() for name, q in self.quantities.items()}, **self.notes}


Refit = Callable[[Relief, Datum, float, bool], Datum]


def measure(
    particles: Particles,
    datum: Datum | frame.Sphere | frame.Plane | str = "sphere",
    before: Particles | surface.Undisturbed | None = None,
    search: locate.Search = locate.WIDE_SEARCH,
    *,
    centre: tuple[float, float, float] | None = None,
    datum_radius: float | None = None,
    what: str = "the snapshot",
) -> Measures:
    """Measure the crater in a cloud of particles.

    ``datum`` is a ``matter.geometry.frame.Sphere`` or ``Plane``, a ``crater.ground.datum.Datum``, or ``"sphere"`` /
    ``"plane"`` to be fitted to the far field (``centre`` and ``datum_radius`` [m] are kept where given). ``before`` is
    the same target before the impact: heights are then taken relative to it, point by point; on a sphere, which rings
    as a whole, also relative to the ground beyond three radii. Where it is not known and the datum is fitted, ground
    that ends inside the blanket has no measures. The centre is found, not assumed; how far and where is the
    ``search``.

    Raises ``InputError`` for clouds that cannot be measured (fewer than 100 particles, not finite, all ejecta).
    """
    fitted = isinstance(datum, str)
    body = None
    if isinstance(datum, str):
        cloud = clouds.particle_cloud(particles, what)
        body = cloud.select(clouds.supported(cloud, what=what))
        start = locate.first_datum(body, datum, centre, datum_radius)
    else:
        start = of_frame(datum)
    ground = (
        locate.ground_before(before, start, search.reach, search.sectors) if isinstance(before, Particles) else before
    )
    if body is not None and not (
        search.gravity and search.rise_limit
    ):  # the height over a datum decides on nothing that carries the ground
        scene = locate.scene_of(body, start, ground, search)
    else:
        scene = locate.prepare(particles, start, ground, search, what)
    refit = (
        (lambda relief, current, radius, rough: far_field.refit(relief, current, radius, centre, datum_radius, rough))
        if fitted
        else None
    )
    return measure_scene(scene, refit, search.seed, search.sectors)


def measure_scene(
    scene: locate.Scene,
    refit: Refit | None = None,
    seed: int = 1,
    sectors: int = 24,
    turns: int = 8,
    methods: str = "four",
) -> Measures:
    """Measure a prepared scene: centre and datum are iterated until neither moves, then the profile is read off.

    ``methods`` of the last look as in ``surface.measure_heights``.
    """
    ground, radius = _settle(scene, refit, sectors, turns, methods)
    if refit is not None:
        if radius > 0.0 and not far_field.constrains_datum(ground, radius):
            return _none(ground, profile_of(ground), {}, _narrow(ground, radius))
        level = Quantity(None, None, "m", "the datum is fitted to the ground around the crater")
        return read_off(ground, radius, ground.datum.errors, level, seed, {})
    if scene.before is not None:
        ground, errors, level = _over_ground_before(ground, radius or NO_LEVEL * scene.reach)
        return read_off(ground, radius, errors, level, seed, {})
    # the datum is not this method's own far field: take out how the colour field stands to the volume
    offset, sigma = far_field.level_of_method(ground, radius or NO_LEVEL * scene.reach)
    level = Quantity(None, None, "m", "the ground before the impact is not known")
    return read_off(_raised(ground, -offset), radius, ((sigma, 0.0),), level, seed, {"method_level_m": offset})


def _over_ground_before(ground: Relief, radius: float) -> tuple[Relief, tuple[tuple[float, float], ...], Quantity]:
    """Heights over the ground before the impact, the ways in which they may be off (``Datum.errors``), and how the
    ground beyond the blanket rose or fell.

    Flat ground does not move as a whole: nothing is taken off. A body rings: its far field's level is taken off where
    that is known, and otherwise what the outermost ground stands at, blanket and all, is in the error (uniform between
    zero and that).
    """
    _, method = far_field.level_of_method(ground, radius, before_known=True)
    value, sigma = far_field.level(ground, radius)
    reason = (
        f"fewer than {far_field.FEWEST_FAR} rings of ground lie beyond {far_field.FAR:g} crater radii: it ends at "
        f"{far_field.radii(ground, radius):.1f}"
    )
    level = quantity(value, {"datum": sigma}, "m", reason)
    if not ground.datum.is_sphere:
        return ground, ((method, 0.0),), level
    if level.value is None or level.sigma is None:
        return ground, ((method, 0.0), (abs(far_field.outermost_height(ground, radius)) / np.sqrt(3.0), 0.0)), level
    return _raised(ground, -level.value), ((method, 0.0), (level.sigma, 0.0)), level


def _narrow(ground: Relief, radius: float) -> str:
    """Why ground that ends close to a hollow of this ``radius`` [m] has no measures."""
    return (
        f"the ground ends at {far_field.radii(ground, radius):.1f} radii of the hollow, inside its blanket: within "
        f"some {far_field.NARROWEST:.0f} radii of the rim only the ground before the impact, or a given datum, says "
        f"what depth and diameter are"
    )


def _raised(ground: Relief, by: float) -> Relief:
    """All heights raised by ``by`` [m]."""
    return replace(
        ground, methods={name: heights + by for name, heights in ground.methods.items()}, rays=ground.rays + by
    )


def _settle(scene: locate.Scene, refit: Refit | None, sectors: int, turns: int, methods: str) -> tuple[Relief, float]:
    """Relief about the crater's centre, by every method, and the crater's radius [m] (0 where there is no hollow)."""
    datum, radius = scene.datum, 0.0
    rough = 3 if refit is not None else 2
    ground = locate.look(scene, datum, sectors, coarse=2.0)
    for turn in range(turns):
        if turn < rough:
            # the first look may go anywhere within reach; later ones stay with the hollow that was found
            east, north, radius = locate.depression(
                ground, scene.within if turn == 0 else max(2.0 * radius, 0.1 * scene.reach)
            )
        else:
            east, north, closer = _recentre(ground, radius)
            radius = closer or radius
        if radius == 0.0 and (refit is None or turn >= rough):
            break
        new = datum if refit is None else refit(ground, datum, max(radius, NO_HOLLOW * scene.reach), turn < rough)
        new = new.moved(east, north)
        rise = (
            abs(new.radius - datum.radius)
            if new.is_sphere
            else abs(np.dot(np.subtract(new.centre, datum.centre), new.axes[2]))
        )
        still = max(float(np.hypot(east, north)), float(rise)) < 0.05 * float(ground.columns.spacing[0])
        datum = new
        edge = locate.edge_of(scene.body, datum)
        if edge > 1.5 * radius:
            scene = replace(scene, reach=min(scene.reach, edge))
        if (still and turn >= rough) or turn == turns - 1:
            break
        ground = locate.look(scene, datum, sectors, coarse=2.0 if turn < rough - 1 else 1.0)
    return locate.look(scene, datum, sectors, methods), radius


def _recentre(ground: Relief, radius: float) -> tuple[float, float, float]:
    """Shift of the axis to the centre of the apparent rim, and its mean radius [m]; zeros where too few sectors
    close."""
    cells = closed(ground.cell)
    ruler = make_ruler(ground, radius, cells.mean(axis=1))
    radii = sector_radii(cells, ruler, radius)
    if np.isfinite(radii).sum() < 0.5 * len(radii):
        return 0.0, 0.0, 0.0
    (mean, east, north, *_), _ = harmonics(radii)
    size = float(np.hypot(east, north))
    scale = min(1.0, 0.3 * radius / size) if size > 0.0 else 1.0
    return float(east * scale), float(north * scale), float(mean)


def read_off(
    ground: Relief,
    radius: float,
    errors: tuple[tuple[float, float], ...],
    level: Quantity,
    seed: int,
    notes: dict[str, object],
) -> Measures:
    """All measures of a settled relief with their errors; ``errors`` are the ways in which the datum may be off
    (``Datum.errors``), ``level`` how the ground beyond the blanket stands to that before the impact."""
    profile = profile_of(ground)
    if radius <= 0.0:
        return _none(
            ground, profile, notes, "no hollow: the ground departs from the datum by less than its own scatter"
        )
    cells = closed(ground.cell)
    ruler = make_ruler(ground, radius, cells.mean(axis=1))
    outermost = 0.9 * radius
    first = shape_of(cells.mean(axis=1), ruler, ground.datum, None, outermost)
    if not np.isfinite(first.apparent) or first.depth <= 0.0:
        return _none(ground, profile, notes, "no closed hollow: the wall does not rise to the datum")
    as_it_lies = cells
    cells, ellipticity = _round(cells, ruler, first.apparent)
    mean = cells.mean(axis=1)
    finder = make_crest_finder(ruler, mean, first.apparent, first.depth)
    base = shape_of(mean, ruler, ground.datum, finder, outermost)
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    draws = _pairs_of_sectors(rng, cells.shape[1])
    hollow = Hollow(ground, radius, cells, ruler, finder, base, outermost, draws, errors, ellipticity, level)
    notes = {**notes, "by_method": hollow.by_method, **_relief_facts(ground, ruler, mean, base.apparent)}
    notes["by_azimuth"] = forms.by_azimuth(as_it_lies, cells, ruler, outermost, base.rim)
    shallow = _shallow_reason(quantities.depth_m(hollow), hollow)
    missing = {"": "", "diameter": shallow, "rim": shallow or _rim_reason(quantities.rim_height_m(hollow), hollow)}
    measured = {
        row.name: Quantity(None, None, row.unit, missing[row.needs])
        if missing[row.needs]
        else getattr(quantities, row.name)(hollow)
        for row in TABLE
    }
    return Measures(measured, profile, ground.datum, ground, notes)


def _pairs_of_sectors(rng: np.random.Generator, sectors: int) -> np.ndarray:
    """Sectors (trials, sectors) drawn with replacement, two adjacent ones at a time: particles of one reach into the
    next (heights of neighbours correlate by 0.15 to 0.27 at 12 to 5 particles a radius, of the next but one by none).
    """
    first = rng.integers(0, sectors, size=(BOOTSTRAPS, (sectors + 1) // 2))
    return np.stack([first, (first + 1) % sectors], axis=-1).reshape(BOOTSTRAPS, -1)[:, :sectors]


def _round(cells: np.ndarray, ruler: Ruler, apparent: float) -> tuple[np.ndarray, Quantity]:
    """Cells stretched along the radius so that an elliptical crater becomes the circle of equal area, where the
    ellipse is significant."""
    radii = sector_radii(cells, ruler, apparent)
    if np.isfinite(radii).sum() < 0.75 * len(radii):
        return cells, Quantity(None, None, "1", "the apparent rim is not closed")
    (mean, _, _, c2, s2), scatter = harmonics(radii)
    amplitude = float(np.hypot(c2, s2))
    sigma = scatter * np.sqrt(2.0 / np.isfinite(radii).sum())
    flat = 2.0 * amplitude / (mean + amplitude)
    ellipticity = Quantity(flat, float(2.0 * sigma / mean), "1")
    if amplitude < 4.0 * sigma or flat < 0.04:
        return cells, ellipticity
    azimuth = (np.arange(cells.shape[1]) + 0.5) * 2.0 * np.pi / cells.shape[1]
    local = mean + c2 * np.cos(2.0 * azimuth) + s2 * np.sin(2.0 * azimuth)
    equal = np.sqrt(np.mean(local**2))
    return np.column_stack(
        [np.interp(ruler.s * local[k] / equal, ruler.s, cells[:, k]) for k in range(cells.shape[1])]
    ), ellipticity


def _relief_facts(ground: Relief, ruler: Ruler, mean: np.ndarray, apparent: float) -> dict[str, object]:
    """RMS height of the profile inside 1.5 apparent radii [m] (of a smaller hollow: the innermost ring), and the
    number of spacings across the radius."""
    matter = ruler.area > 0.0
    inside = matter & (ruler.s <= max(1.5 * apparent, float(ruler.s[matter].min(initial=np.inf))))
    if not inside.any():
        return {"rms_relief_m": float("nan"), "spacings_per_radius": float("nan")}
    rms = float(np.sqrt(np.average(mean[inside] ** 2, weights=ruler.area[inside])))
    return {"rms_relief_m": rms, "spacings_per_radius": apparent / float(np.interp(apparent, ruler.s, ruler.d))}


def _shallow_reason(depth: Quantity, hollow: Hollow) -> str:
    """Why a hollow has no diameter: shallower than the particles resolve; empty where it has one."""
    limit = max(SHALLOWEST * hollow.spacing, 2.0 * (depth.sigma or 0.0))
    if depth.value is not None and depth.value >= limit:
        return ""
    return (
        f"a trough {readable.length(hollow.base.depth)} deep, less than the {readable.length(limit)} that this "
        f"spacing resolves, has no diameter"
    )


def _rim_reason(height: Quantity, hollow: Hollow) -> str:
    """Why no rim can be stated, whose crest has this ``height``; empty where one can."""
    ruler, base = hollow.ruler, hollow.base
    if height.value is None:
        return "no crest outside the apparent rim"
    if height.value < (height.sigma or 0.0):
        return f"no rim: the crest stands {readable.length(height.value)} above the datum, within its error"
    near = (ruler.s > base.apparent) & (ruler.s < max(1.8 * base.apparent, base.rim))
    fraction = float(np.mean((ruler.fine @ hollow.cells)[near].max(axis=0) > 0.0)) if near.any() else 0.0
    return (
        ""
        if fraction >= CLOSED_RIM
        else f"no closed rim: only {fraction:.0%} of the sectors rise above the datum outside the crater"
    )


def _none(ground: Relief, profile: Profile, notes: dict[str, object], reason: str) -> Measures:
    """Measures of ground without a crater, with how rough it is (RMS over the far field's level)."""
    mean = ring_mean(ground.cell)
    known = np.isfinite(mean)
    area = ground.datum.area_between(ground.columns.edges[:-1], ground.columns.edges[1:])[known]
    rms = float(np.sqrt(np.average(mean[known] ** 2, weights=area))) if known.any() else float("nan")
    deepest = float(-np.min(mean[known])) if known.any() else float("nan")
    facts = {**notes, "rms_relief_m": rms, "deepest_ring_m": deepest}
    text = f"{reason} (RMS of the profile {readable.length(rms)}, deepest ring {readable.length(deepest)})"
    return Measures(
        {name: Quantity(None, None, unit, text) for name, unit in UNITS.items()}, profile, ground.datum, ground, facts
    )
