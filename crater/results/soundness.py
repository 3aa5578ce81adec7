"""How far the numbers of a run can be relied on: how finely the projectile was resolved, the pressures beside the
planar limit, what was conserved, what an edge or a correction took, how far grains overlapped. Read from the stages'
reports; what is out of range is a caution, in words that say what it means."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from matter.files import archive
from matter.wording import readable

FEWEST_PER_RADIUS = 5.0
"""Below this many particles per projectile radius the shock in it is not resolved: it is some eight spacings wide, and
with 7 of them a sphere of aluminium at 5 km/s reached 27 of 59.9 GPa, with 20 of them 35
(docs/results/sph_benchmarks). ``--check`` warns below it, the page says so, and no errors are stated."""
AS_MANY = 0.995
"""A projectile of N whole particles may have this share of the limit."""
ABOVE, BELOW = 1.2, 0.8
"""Largest pressure over the planar limit: more is no shock, less is one that the spacing smears out."""
BED_RADII = 3.0
"""Radii of the settled crater that the bed of grains should reach: within some three there is blanket everywhere."""
REMOVED = 0.01
"""Fraction of the projectile's angular momentum whose removal is worth a caution."""


def read(run: Path) -> dict[str, dict[str, Any]]:
    """Reports of the shock stage (``sph``) and of the collapse (``dem``); empty where a stage left none."""
    files = {"sph": run / "2_sph" / "stage_report.json", "dem": run / "5_dem" / "stage_report.json"}
    return {stage: archive.read_json(file) if file.is_file() else {} for stage, file in files.items()}


def bed_radii(grains: Mapping[str, Any], diameter: float) -> float | None:
    """Radius of a bed over that of a crater of this apparent ``diameter`` [m] in it, along the datum; ``grains``: the
    attributes of their snapshot. None of a whole body, or where there is no crater."""
    domain = grains.get("domain") or {}
    wide = domain.get("radius_m", domain.get("datum_radius_m", 0.0) * domain.get("cone_half_angle_rad", 0.0))
    flat_or_cap = grains.get("frame") in ("plane", "sphere")
    return 2.0 * float(wide) / diameter if flat_or_cap and wide > 0.0 and diameter > 0.0 else None


def facts(run: Path, radii: float | None = None) -> dict[str, Any]:
    """What ``measures.json`` says of it: ``projectile_particles``, ``particles_per_radius``, ``peak_pressure_Pa``,
    ``planar_limit_Pa`` and their ratio, the fraction of angular momentum removed, the largest overlap, the ``radii``
    of the settled crater that the bed reaches (``bed_radii``); ``not_resolved``, the verdict on a projectile of too
    few particles; and ``cautions``, sentences. Keys of what is not known are left out."""
    reports = read(run)
    ball, reached = reports["sph"].get("projectile", {}), reports["sph"].get("peak_pressure", {})
    known: dict[str, Any] = {
        "projectile_particles": ball.get("particles"),
        "particles_per_radius": ball.get("particles_per_radius"),
        "peak_pressure_Pa": reports["sph"].get("peak_pressure_Pa"),
        "planar_limit_Pa": reached.get("planar_limit_Pa"),
        "planar_speed_m_s": reached.get("planar_speed_m_s"),
        "removed_angular_momentum_over_projectile": reports["sph"].get("removed_angular_momentum_over_projectile"),
        "removed_angular_momentum_over_all": reports["sph"].get("removed_angular_momentum_over_all"),
        "overlap_max_radii": reports["dem"].get("overlap_max"),
        "bed_radii": radii,
    }
    known = {name: value for name, value in known.items() if value is not None}
    if "peak_pressure_Pa" in known and known.get("planar_limit_Pa"):
        known["peak_over_planar_limit"] = known["peak_pressure_Pa"] / known["planar_limit_Pa"]
    warnings = [str(words).rstrip(".") for words in reports["sph"].get("warnings", [])]
    cautions = [*_of_shock(known), *warnings, *_of_collapse(reports["dem"]), *_of_bed(radii)]
    if not resolved(known.get("particles_per_radius")):
        known["not_resolved"] = (
            f"{known['particles_per_radius']:.2g} particles per projectile radius, fewer than {FEWEST_PER_RADIUS:g}; "
            f"no errors are stated but those that were measured with another size"
        )
    return {**known, "cautions": cautions} if known or cautions else {}


def resolved(per_radius: float | None) -> bool:
    """Whether so many particles per projectile radius resolve the shock in it; what is not known counts as enough."""
    return per_radius is None or per_radius >= AS_MANY * FEWEST_PER_RADIUS


def _of_shock(known: Mapping[str, Any]) -> list[str]:
    said = []
    fine, count = known.get("particles_per_radius"), known.get("projectile_particles")
    if fine is not None and not resolved(fine):
        said.append(
            f"the projectile has {fine:.2g} particles per radius ({count} in all), fewer than "
            f"{FEWEST_PER_RADIUS:g}: the shock in it is not resolved; "
            "peak pressures, melt and vapour are rough, crater sizes less so"
        )
    over = known.get("peak_over_planar_limit")
    if over is not None and not BELOW <= over <= ABOVE:
        limit = f"the planar limit of {readable.amount(known['planar_limit_Pa'] * 1e-9, 'GPa', 3)}"
        peak = (
            f"the largest pressure of a single particle, "
            f"{readable.amount(known['peak_pressure_Pa'] * 1e-9, 'GPa', 3)}, is {over:.2g} times {limit}"
        )
        why = (
            "higher than any shock in this impact: an artefact of individual particle collisions"
            if over > ABOVE
            else "the spacing smears the first shock out"
        )
        said.append(f"{peak}: {why}")
    # of a body that turns, the projectile's part is negligible
    removed, of_all = (known.get(f"removed_angular_momentum_over_{of}") for of in ("projectile", "all"))
    if removed is not None and removed > REMOVED and (of_all is None or of_all > REMOVED):
        said.append(
            f"correcting the tree's forces removed {removed:.1%} of the projectile's angular momentum; the drift of "
            f"angular momentum does not show it"
        )
    return said


def _of_collapse(report: Mapping[str, Any]) -> list[str]:
    """Overlaps beyond the warning and energy taken from returning ejecta: by the report's numbers, else by its
    notes."""
    overlap, limit, lost = (
        report.get("overlap_max"),
        report.get("overlap_warning"),
        report.get("dissipated_returning_J"),
    )
    said = []
    if limit is not None and overlap is not None:
        if overlap > limit:
            said.append(
                f"grains overlapped by up to {overlap:.3g} radii, more than the {limit:g} up to which contacts are "
                f"stiff enough"
            )
    if lost:
        said.append(
            f"returning ejecta faster than the contacts can take lost {readable.amount(lost, 'J', 3)} in scaled "
            f"contacts"
        )
    if limit is None:
        said += [
            note.rstrip(".")
            for note in report.get("notes", [])
            if note.startswith(("Overlaps reached", "Returning ejecta"))
        ]
    return said


def _of_bed(radii: float | None) -> list[str]:
    if radii is None or radii >= BED_RADII:
        return []
    return [
        f"the bed of grains ends at {radii:.3g} radii of the settled crater: below {BED_RADII:g} it ends within the "
        f"blanket of what was thrown out, and no ground without blanket lies round the crater"
    ]


def resolution_rows(run: Path) -> list[tuple[str, str]]:
    """The projectile's resolution and the pressures that were reached, as words and values."""
    report = read(run)["sph"]
    ball, reached = report.get("projectile", {}), report.get("peak_pressure", {})
    rows = []
    if ball.get("particles_per_radius"):
        rows.append(("projectile: particles", readable.number(ball["particles"])))
        rows.append(("projectile: particles per radius", readable.number(ball["particles_per_radius"], 3)))
    limit = reached.get("planar_limit_Pa")
    speed = reached.get("planar_speed_m_s")
    if limit:
        rows.append(
            (
                f"planar limit at the vertical speed of {readable.number(speed * 1e-3, 4)} km/s (impedance match of "
                f"both materials)",
                _pressure(limit),
            )
        )
    elif "planar_limit_note" in reached:
        rows.append(("planar limit", f"none: {reached['planar_limit_note']}"))
    words = {
        "target_largest_Pa": "largest pressure of a single particle of the target",
        "projectile_largest_Pa": "largest pressure of a single particle of the projectile",
        "projectile_half_Pa": "pressure that half of the projectile's mass reached",
        "projectile_nine_tenths_Pa": "pressure that nine tenths of the projectile's mass reached",
    }
    for name, word in words.items():
        if name in reached:
            rows.append(
                (
                    word,
                    _pressure(reached[name])
                    + (f" ({reached[name] / limit:.2f} of the planar limit)" if limit else ""),
                )
            )
    if "peak_pressure_Pa" in report and not reached:
        rows.append(("largest pressure of a single particle", _pressure(report["peak_pressure_Pa"])))
    return rows


def _pressure(value: float) -> str:
    return readable.amount(value * 1e-9, "GPa", 3) if value >= 1e8 else readable.amount(value * 1e-6, "MPa", 3)


def _columns(path: Path) -> dict[str, list[str]]:
    if not path.is_file():
        return {}
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]} if len(rows) >= 2 else {}


def _vector(columns: Mapping[str, list[str]], name: str, row: int) -> np.ndarray:
    return (
        np.array([float(columns[f"{name}_{axis}"][row]) for axis in "xyz"]) if f"{name}_x" in columns else np.zeros(3)
    )


def _given(columns: Mapping[str, list[str]], name: str) -> np.ndarray | None:
    """What weight and edges have given by each row; None where a run did not book it."""
    given = np.array([float(value) for value in columns.get(f"outside_{name}", ["nan"])])
    return given if np.isfinite(given).all() else None


def conservation_rows(run: Path, projectile_momentum: float, lever: tuple[float, str]) -> list[tuple[str, str]]:
    """Energy, mass, momentum and angular momentum of the shock stage against stated scales, never against an initial
    value that may be zero.

    ``projectile_momentum`` [kg m/s]; ``lever`` [m] and its name: angular momentum is given over momentum times lever.
    """
    columns = _columns(run / "2_sph" / "history.csv")
    if not columns:
        return []
    kinetic = float(columns["kinetic_J"][0])
    given = _given(columns, "energy_J")
    total = np.array([float(value) for value in columns["total_J"]]) - (0.0 if given is None else given)
    drift = (total - total[0]) / kinetic
    mass = [float(columns["mass_kg"][row]) for row in (0, -1)]
    rows = [
        ("total energy, largest departure over the initial kinetic energy", f"{np.abs(drift).max():.3%}"),
        ("total energy, at the end, over the initial kinetic energy", f"{drift[-1]:+.3%}"),
        ("mass, relative change", readable.number(mass[1] / mass[0] - 1.0, 3)),
    ]
    size, name = lever
    scale = f"over the projectile's momentum times {name} ({readable.length(size)})"
    edges = _edges(run)
    moved = _percent(_change(columns, "momentum") / projectile_momentum)
    turned = _change(columns, "outside_angular_momentum" if edges and given is not None else "angular_momentum")
    of_turning = _percent(turned / (projectile_momentum * size))
    if not edges:
        rows.append(("linear momentum, change over the projectile's", moved))
        rows.append((f"angular momentum, change {scale}", of_turning))
    else:
        if given is not None:
            taken = (given[0] - given[-1]) / kinetic
            rows.append((f"energy that the edges took ({edges}), the same way", f"{taken:.3%}"))
            left = _percent(_change(columns, "momentum", "outside_momentum") / projectile_momentum)
            rows.append(("linear momentum, change beyond what edges and weight gave, over the projectile's", left))
        net = (
            f"linear momentum that the edges took ({edges}), net of the weight that they carry, over the projectile's"
        )
        rows.append((net, moved))
        rows.append((f"angular momentum that the edges took, {scale}", of_turning))
    removed = float(np.linalg.norm(_vector(columns, "removed_angular_momentum", -1)))
    if removed:
        what = f"angular momentum that the correction of the tree's forces removed, {scale}"
        rows.append((what, _percent(removed / (projectile_momentum * size))))
        own = read(run)["sph"].get("removed_angular_momentum_over_projectile")
        if own is not None:
            rows.append(("the same over the projectile's angular momentum about the target's centre", _percent(own)))
    return rows


def _change(columns: dict[str, list[str]], name: str, less: str = "") -> float:
    """Size of the change of a vector from the first row to the last, without that of another."""
    begun, end = (_vector(columns, name, row) - (_vector(columns, less, row) if less else 0.0) for row in (0, -1))
    return float(np.linalg.norm(end - begun))


def _percent(value: float) -> str:
    """A fraction in percent, or as a power of ten where it is rounding."""
    return f"{value:.3%}" if value >= 1e-5 or value == 0.0 else readable.number(value, 2)


def _edges(run: Path) -> str:
    """What ends the ground, in words; empty for a body and for ground that nothing holds."""
    report = read(run)["sph"]
    if "edges" in report:
        held = report["edges"]
        return (
            ""
            if held is None
            else ", ".join(
                f"{name} {held[name]}"
                for name in ("sides", "floor")
                if held[name] != "free" and name not in held.get("passing", ())
            )
        )
    target = run / "2_sph" / "target.json"
    flat = target.is_file() and archive.read_json(target).get("frame") == "plane"
    return "and the ground's own weight, where nothing holds it" if flat else ""


def collapse_rows(run: Path) -> list[tuple[str, str]]:
    """Balances of the granular collapse, its overlaps, and what was taken out of it, as words and values."""
    report = read(run)["dem"]
    rows = []
    if "overlap_max" in report:
        limit = report.get("overlap_warning")
        rows.append(
            (
                "largest overlap of two grains, in radii" + (f" (warning above {limit:g})" if limit else ""),
                readable.number(report["overlap_max"], 3),
            )
        )
    if swelling := report.get("ground_fraction"):
        rows.append(
            (
                "solid fraction of the ground round the cavity at the handover, at its least and at the end",
                ", ".join(f"{swelling[key]:.3f}" for key in ("before", "least", "at_rest")),
            )
        )
    columns = _columns(run / "5_dem" / "history.csv")
    if "dissipated_returning_J" in columns and float(columns.get("kinetic_J", ["0"])[0]) > 0.0:
        lost, first = float(columns["dissipated_returning_J"][-1]), float(columns["kinetic_J"][0])
        rows.append(
            (
                "energy taken from returning ejecta by scaled contacts, over the kinetic energy handed over",
                f"{lost / first:.3%}",
            )
        )
    for key, word in (
        ("energy_error", "energy balance"),
        ("momentum_error", "momentum balance"),
        ("angular_momentum_error", "angular momentum balance"),
    ):
        if isinstance(report.get(key), (int, float)):
            rows.append(
                (
                    f"{word}, largest error" if key != "energy_error" else f"{word}, error at the end",
                    readable.number(report[key], 2),
                )
            )
    for key, book in report.get("booked", {}).items():
        if book.get("grains"):
            rows.append(
                (
                    f"left the bed: {key.replace('_', ' ')}",
                    f"{book['grains']} grains, {readable.amount(book['mass_kg'], 'kg', 3)}",
                )
            )
    return rows
