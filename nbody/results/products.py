"""Everything that a census leaves: tables 4-7, 10, 11 and figures 14-18 as CSV and PNG, and a summary."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from matter.files import archive
from matter.wording import drawing
from nbody.masses.system import jovian
from nbody.population.encounters import ENTRY
from nbody.population.rules import Statistic
from nbody.results import census_tables, figures


def write(table: dict[str, np.ndarray], attributes: dict, out: Path) -> str:
    """Write all products of a census into ``out`` and return its summary as text."""
    system = jovian(str(attributes["target"]))
    moons, target = system.moons, system.moon(str(attributes["target"]))
    texts = {
        "table_04_events": census_tables.events(table, moons),
        "table_05_subsets": census_tables.flags(table, moons),
        "table_06_basins": census_tables.basins(table, target),
        "table_07_latitudes": census_tables.latitudes(table, target),
        "speeds": census_tables.speeds(table, moons),
        "hemispheres": census_tables.hemispheres(table, moons),
    }
    for index, moon in enumerate(moons):
        number = {"callisto": "10", "ganymede": "11"}.get(moon.name, "direct")
        texts[f"table_{number}_{moon.name}_direct_collisions"] = census_tables.direct(table, index)
    for name, text in texts.items():
        archive.write_text(out / f"{name}.csv", text)
    if len(census_tables.hits(table, target)["speed"]) and drawing.possible("the census", print):
        figures.events_over_speed(table, moons, out)
        figures.impacts_over_speed(table, moons, out)
        figures.approach_ratio(table, moons, target, out)
        figures.impact_angles(table, moons, target, out)
        figures.basin_angles(table, moons, target, out)
        figures.latitude_dependence(table, moons, target, out)
    summary = summarise(table, attributes)
    archive.write_json(out / "summary.json", summary)
    return as_text(summary)


def summarise(table: dict[str, np.ndarray], attributes: dict) -> dict:
    """The main numbers of a census: ``{"census": attributes, "moons": {name: {quantity: {value, standard_error,
    count}}}}``."""
    system = jovian(str(attributes["target"]))
    result: dict = {"census": attributes, "moons": {}}
    for index, moon in enumerate(system.moons):
        hit = census_tables.hits(table, index)
        if not len(hit["speed"]):
            continue
        masks, weight = census_tables.subsets(hit), hit["weight"]
        numbers: dict[str, Statistic] = dict(census_tables.classes(table, index))
        numbers["retrograde_over_prograde"] = census_tables.ratio(weight, masks["retrograde"], masks["prograde"])
        numbers["periapsis_over_none"] = census_tables.ratio(weight, masks["periapsis"], masks["no periapsis"])
        numbers["mean_angle_deg"] = census_tables.mean_angle(hit, np.ones(len(weight), bool))
        for name, window in census_tables.BASINS.items():
            numbers[f"{name}_mean_angle_deg"] = census_tables.mean_angle(hit, census_tables.in_band(hit, *window))
        inside = masks["retrograde"] & census_tables.in_band(hit, *census_tables.BASINS["Valhalla"])
        numbers["Valhalla_retrograde_mean_angle_deg"] = census_tables.mean_angle(hit, inside)
        numbers["leading_over_trailing"] = census_tables.asymmetry(table, index)["all"]
        entries = table["weight"][(table["event"] == ENTRY) & (table["moon"] == index)]
        rate, particles = float(entries.sum()), int(attributes["particles"])
        numbers["entries_per_particle"] = Statistic(
            rate / particles, float(np.sqrt((entries**2).sum())) / particles, len(entries)
        )
        result["moons"][moon.name] = {name: value._asdict() for name, value in numbers.items()}
    return result


def as_text(summary: dict) -> str:
    """The summary as a few lines."""
    census = summary["census"]
    lines = [
        f"{census['population']} population, {census['integrator']}: {census['particles']} particles in "
        f"{census['wall_s']:.1f} s"
    ]
    for moon, numbers in summary["moons"].items():
        back, front = numbers["v2_retrograde_mean"], numbers["v4_prograde_mean"]
        side = numbers["retrograde_over_prograde"]
        lines.append(
            f"{moon}: {numbers['mean']['impacts']} impacts, retrograde {_km(back)}, prograde {_km(front)}, "
            f"retrograde/prograde {side['value']:.2f} +- {side['standard_error']:.2f}, "
            f"angle {numbers['mean_angle_deg']['value']:.1f} +- {numbers['mean_angle_deg']['standard_error']:.1f} deg"
        )
    return "\n".join(lines)


def _km(number: dict) -> str:
    return f"{number['value'] / 1e3:.2f} +- {number['standard_error'] / 1e3:.2f} km/s"
