"""Tables of the thesis (4-7, 10, 11) and further ones from a census, each number with its error."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence

import numpy as np

from nbody.masses.system import Body
from nbody.population import encounters
from nbody.population.encounters import APPROACH, COLLISION, ENTRY, EXIT
from nbody.population.rules import Statistic, weighted_mean
from nbody.results import analytic

Table = dict[str, np.ndarray]
YEAR = 365.25 * 86400.0
# |latitude| windows of 10 deg to either side of the basins (Winter 2017, section 2.3.5)
BASINS = {"Valhalla": (4.7, 24.7), "Asgard": (22.2, 42.2)}
BANDS = [(low, low + 15) for low in range(0, 90, 15)]


def rows_as_csv(header: Sequence[str], rows: Sequence[Sequence]) -> str:
    """Text of a CSV file."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([[f"{value:.6g}" if isinstance(value, float) else value for value in row] for row in rows])
    return buffer.getvalue()


def hits(table: Table, moon: int) -> Table:
    """Constructed collisions with a moon: one per entry."""
    return encounters.select(table, (table["event"] == COLLISION) & (table["moon"] == moon) & (table["direct"] == 0))


def subsets(table: Table) -> dict[str, np.ndarray]:
    """Masks of the four subsets of tables 5 and 6."""
    retrograde, periapsis = table["retrograde"] == 1, table["periapsis"] == 1
    return {"prograde": ~retrograde, "retrograde": retrograde, "no periapsis": ~periapsis, "periapsis": periapsis}


def ratio(weight: np.ndarray, over: np.ndarray, under: np.ndarray) -> Statistic:
    """Ratio of two disjoint weighted counts with its Poisson error."""
    a, b = weight[over].sum(), weight[under].sum()
    if a == 0.0 or b == 0.0:
        return Statistic(float("nan"), float("nan"), int(over.sum() + under.sum()))
    error = a / b * math.sqrt((weight[over] ** 2).sum() / a**2 + (weight[under] ** 2).sum() / b**2)
    return Statistic(float(a / b), float(error), int(over.sum() + under.sum()))


def events(table: Table, moons: Sequence[Body]) -> str:
    """Table 4: events by moon and kind; direct collisions beside them."""
    rows = []
    for index, moon in enumerate(moons):
        of = table["moon"] == index
        counts = [int((of & (table["event"] == kind)).sum()) for kind in (ENTRY, COLLISION, APPROACH, EXIT)]
        rows.append([moon.name, *counts, sum(counts), int((of & (table["direct"] == 1)).sum())])
    return rows_as_csv(["moon", "event_1", "event_2", "event_3", "event_4", "sum", "direct_collisions"], rows)


def flags(table: Table, moons: Sequence[Body]) -> str:
    """Table 5: (weighted) collisions by subset, the two ratios and the ratio of ratios."""
    rows = []
    for index, moon in enumerate(moons):
        hit = hits(table, index)
        masks, weight = subsets(hit), hit["weight"]
        side = ratio(weight, masks["retrograde"], masks["prograde"])
        passed = ratio(weight, masks["periapsis"], masks["no periapsis"])
        rows.append(
            [
                moon.name,
                *(float(weight[mask].sum()) for mask in masks.values()),
                *side[:2],
                *passed[:2],
                passed.value / side.value,
            ]
        )
    names = [name.replace(" ", "_") for name in subsets(hits(table, 0))]
    header = ["moon", *names, "retrograde_over_prograde", "error", "periapsis_over_none", "error", "ratio_of_ratios"]
    return rows_as_csv(header, rows)


def in_band(table: Table, low: float, high: float) -> np.ndarray:
    """Mask of positions with |latitude| in [low, high) degrees."""
    latitude = np.degrees(np.abs(encounters.latitude(table)))
    return (latitude >= low) & (latitude < high)


def mean_angle(table: Table, mask: np.ndarray) -> Statistic:
    """Mean angle from the vertical [deg] of a subset."""
    return weighted_mean(np.degrees(table["angle"][mask]), table["weight"][mask])


def basins(table: Table, moon: int) -> str:
    """Table 6: impacts at the latitudes of the basins by subset, mean angles with errors."""
    hit, rows = hits(table, moon), []
    everything = {"all": np.ones(len(hit["speed"]), bool), **subsets(hit)}
    for name, window in BASINS.items():
        for subset, mask in everything.items():
            inside = mask & in_band(hit, *window)
            rows.append([name, subset, float(hit["weight"][inside].sum()), *mean_angle(hit, inside)[:2]])
    return rows_as_csv(["basin", "subset", "impacts", "mean_angle_deg", "error"], rows)


def latitudes(table: Table, moon: int) -> str:
    """Table 7: mean angle in bands of |latitude|, with the beam model beside it, and the impacts per unit area."""
    hit = hits(table, moon)
    model, fraction = analytic.beam_angles(np.radians(BANDS))
    total, rows = hit["weight"].sum(), []
    for (low, high), angle, part in zip(BANDS, model, fraction):
        inside = in_band(hit, low, high)
        area = math.sin(math.radians(high)) - math.sin(math.radians(low))
        weight = hit["weight"][inside]
        rows.append([
            low, high, int(inside.sum()), *mean_angle(hit, inside)[:2], float(np.degrees(angle)),
            float(weight.sum() / total), float(part), float(weight.sum() / total / area),
            float(math.sqrt((weight**2).sum()) / total /
            area),
        ])  # fmt: skip
    header = ["latitude_low_deg", "latitude_high_deg", "impacts", "mean_angle_deg", "error", "beam_model_deg"]
    return rows_as_csv([*header, "share", "beam_model_share", "impacts_per_area_over_mean", "error"], rows)


def direct(table: Table, moon: int) -> str:
    """Tables 10 and 11: collisions on the way."""
    hit = encounters.select(table, (table["direct"] == 1) & (table["moon"] == moon))
    rows = [
        [int(a), int(b), float(t / YEAR), float(v / 1e3), float(np.degrees(g)), float(z / 1e3), float(h)]
        for a, b, t, v, g, z, h in zip(
            *(hit[n] for n in ("retrograde", "periapsis", "time", "speed", "angle", "z", "step"))
        )
    ]
    return rows_as_csv(["retrograde", "periapsis", "t_yr", "v_imp_km_s", "angle_deg", "z_km", "step_s"], rows)


def classes(table: Table, moon: int) -> dict[str, Statistic]:
    """v_imp,1 ... 4 of section 3.3.1 [m/s]: maximum, mean and minimum of retrograde impacts, mean of prograde ones;
    and the mean of all."""
    hit = hits(table, moon)
    masks, speed, weight = subsets(hit), hit["speed"], hit["weight"]
    back, front = masks["retrograde"], masks["prograde"]
    nothing = Statistic(float("nan"), float("nan"), 0)
    return {
        "v1_retrograde_maximum": Statistic(float(speed[back].max()), float("nan"), int(back.sum()))
        if back.any()
        else nothing,
        "v2_retrograde_mean": weighted_mean(speed[back], weight[back]),
        "v3_retrograde_minimum": Statistic(float(speed[back].min()), float("nan"), int(back.sum()))
        if back.any()
        else nothing,
        "v4_prograde_mean": weighted_mean(speed[front], weight[front]),
        "mean": weighted_mean(speed, weight),
    }


def asymmetry(table: Table, moon: int) -> dict[str, Statistic]:
    """Impacts on the leading over those on the trailing hemisphere: all, and by subset."""
    hit = hits(table, moon)
    lead = hit["leading"] > 0.0
    everything = {"all": np.ones(len(lead), bool), **subsets(hit)}
    return {name: ratio(hit["weight"], mask & lead, mask & ~lead) for name, mask in everything.items()}


def speeds(table: Table, moons: Sequence[Body]) -> str:
    """Impact speeds by class, with the analytic limits as printed and in quadrature."""
    rows = []
    for index, moon in enumerate(moons):
        for name, statistic in classes(table, index).items():
            rows.append([moon.name, name, statistic.value / 1e3, statistic.standard_error / 1e3, statistic.impacts])
        hit = hits(table, index)
        if len(hit["speed"]):
            rows += [[moon.name, "minimum", float(hit["speed"].min() / 1e3), "", len(hit["speed"])]]
            rows += [[moon.name, "maximum", float(hit["speed"].max() / 1e3), "", len(hit["speed"])]]
        for label, quadrature in (("printed", False), ("quadrature", True)):
            low, high = analytic.speed_limits(moon, quadrature)
            rows += [
                [moon.name, f"limit_low_{label}", low / 1e3, "", ""],
                [moon.name, f"limit_high_{label}", high / 1e3, "", ""],
            ]
    return rows_as_csv(["moon", "quantity", "km_s", "error", "impacts"], rows)


def hemispheres(table: Table, moons: Sequence[Body]) -> str:
    """Leading/trailing ratios of the moons."""
    rows = [
        [moon.name, name, statistic.value, statistic.standard_error, statistic.impacts]
        for index, moon in enumerate(moons)
        for name, statistic in asymmetry(table, index).items()
    ]
    return rows_as_csv(["moon", "subset", "leading_over_trailing", "error", "impacts"], rows)


def pairs(table: Table, moon: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Figure 16: of each entry with both, distance [m] of the closest approach, speed at impact over speed there,
    weight."""

    def keyed(mask: np.ndarray) -> dict[tuple[int, int], int]:
        rows = np.flatnonzero(mask & (table["moon"] == moon))
        rows = rows[np.argsort(table["time"][rows], kind="stable")]
        seen: dict[int, int] = {}
        keys = {}
        for row, particle in zip(rows.tolist(), table["particle"][rows].tolist()):
            seen[particle] = seen.get(particle, -1) + 1
            keys[particle, seen[particle]] = row
        return keys

    hit_rows = keyed((table["event"] == COLLISION) & (table["direct"] == 0))
    near = keyed(table["event"] == APPROACH)
    common = sorted(hit_rows.keys() & near.keys())
    a, b = np.array([hit_rows[key] for key in common], int), np.array([near[key] for key in common], int)
    return table["distance"][b], table["speed"][a] / table["speed"][b], table["weight"][b]
