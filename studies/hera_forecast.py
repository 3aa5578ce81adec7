"""What Hera should find at Dimorphos: joint samples from few runs, what was observed before, and stated factors.

Momentum (Cheng et al. 2023, Nature 616, 457, eq. 1), m U what the spacecraft brought, E the direction of the ejecta:

    M dv = m U + m (beta - 1) (E . U) E
    M dv . t = p c_t (1 + kappa (beta_n - 1)),   p = m |U|, c_t the cosine of flight and track,
                                                 kappa (beta_t - 1) / (beta_n - 1) of the runs

beta along the normal n from the quick run at 2,400 kg/m^3, B = 1.713; eps porosity, s its fitted slope, phi friction:

    beta_n - 1 = B e^(-s (eps - eps_0)) (tan phi / tan 31 deg)^(-0.87) L(Y) f_spacecraft f_blocks f_numerics f_draw

Width D of the hollow, mass that left and resurfaced fraction go as powers of the density that are fitted to the three
density runs, of tan phi (friction runs; D as the cube root of the mass) and of the cohesion Y: by pi-scaling in the
gravity and the strength regime (Holsapple 1993, Annu. Rev. Earth Planet. Sci. 21, 333)

    S(Y) = (1 + (Y / Y*)^(1 + mu/2))^(-mu / (2 + mu)),   Y* = rho U^2 (g a / U^2)^(2 / (2 + mu))

D ~ S, mass ~ S^2.9, and only the late part of beta - 1 feels it: L = 1 - 0.13 (1 - S^2.9). a/b - a/b before ~ D^n with
n fitted; class by the equation of ``crater.bodies.classes``. The change of shape takes part of the change of period,
dP / P = -2 de, e = 0.3 (2 a^2 - b^2 - c^2) / r^2 with half axes, so that the observed change of speed is lessened.

Each column weights the same samples of the factors (``forecasts/<name>_inputs.toml``): by its prior of the density and
by the observed change of speed; ``all_known`` by the observed shape and mass as well. Draws are resampled
systematically. Random numbers are the raw output of PCG64, which no version of numpy changes.

Command: ``python -m studies.hera_forecast [--table] [--check]`` writes ``hera_v0.toml``, ``hera_v0_draws.h5`` and
``hera_v0.png`` into ``--out`` (``forecasts``); a file that is there and differs is never written over.
"""

from __future__ import annotations

import argparse
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from matter.constants import G

FOLDER = Path(__file__).resolve().parents[1] / "forecasts"
COLUMNS = ("makadia", "flat", "all_known")
CLASSES = ("crater", "reshaped", "neither")
LATE, MASS_POWER, HEIGHT, WIDE, CERTAIN = 0.13, 2.9, 30.3, 107.0, 70.0
"""Late part of beta - 1; power of S in the mass; deepest change [m] at the width WIDE [m]; width [m] below which an
edge is certain."""
EDGE_AT_WIDE = 2.5 / 7.0
"""Jeffreys' mean of 2 in 6 runs."""
Samples = dict[str, np.ndarray]


def inputs(name: str = "hera_v0", folder: Path = FOLDER) -> dict[str, Any]:
    """What the forecast of this name stands on."""
    return tomllib.loads((folder / f"{name}_inputs.toml").read_text())


def uniforms(seed: int, count: int) -> np.ndarray:
    """Numbers (count,) in (0, 1), from the upper 52 bits of PCG64."""
    return ((np.random.PCG64(seed).random_raw(count) >> np.uint64(12)).astype(float) + 0.5) * 2.0**-52


def valued(law: str, values: list[float], u: np.ndarray, within: list[float] | None = None) -> np.ndarray:
    """The quantiles u of a law: normal (mean, sigma), lognormal (median, sigma of ln), uniform, log_uniform (low,
    high), triangular (low, mode, high), chance (probability of 1). ``within`` cuts a normal. Raises ``ValueError``
    for another law."""
    if law == "normal":
        mean, sigma = values
        low, high = (ndtr((end - mean) / sigma) for end in within) if within else (0.0, 1.0)
        return mean + sigma * ndtri(low + u * (high - low))
    if law == "lognormal":
        return values[0] * np.exp(values[1] * ndtri(u))
    if law == "uniform":
        return values[0] + u * (values[1] - values[0])
    if law == "log_uniform":
        return values[0] * np.exp(u * math.log(values[1] / values[0]))
    if law == "triangular":
        low, mode, high = values
        turn = (mode - low) / (high - low)
        rise = low + np.sqrt(u * (high - low) * (mode - low))
        return np.where(u < turn, rise, high - np.sqrt((1.0 - u) * (high - low) * (high - mode)))
    if law == "chance":
        return (u < values[0]).astype(float)
    raise ValueError(f"no law {law!r}")


def power(x: list[float], y: list[float]) -> tuple[float, float]:
    """y = c x^n by least squares in the logarithms: c and n."""
    slope, start = np.polyfit(np.log(x), np.log(y), 1)
    return float(np.exp(start)), float(slope)


def fits(given: Mapping[str, Any]) -> dict[str, float]:
    """Powers and constants that the runs give; densities over 2,400 kg/m^3, tangents over that of 31 deg."""
    runs, rough, body = given["run"], given["friction_run"], given["body"]
    rho = [run["density_kg_m3"] / 2400.0 for run in runs]
    tangent = [math.tan(math.radians(run["angle_deg"])) / math.tan(math.radians(31.0)) for run in rough]
    pores = np.array([1.0 - run["density_kg_m3"] / body["solid_kg_m3"] for run in runs])
    excess = np.array([run["beta_normal"][0] - 1.0 for run in runs])
    found = {"excess": float(excess[0]), "porosity": float(pores[0])}
    away = pores - pores[0]
    found["pore_slope"] = float(-(away @ np.log(excess / excess[0])) / (away @ away))
    for name in ("hollow_m", "mass_left_kg"):
        found[name], found[f"{name}_density"] = power(rho, [run[name][0] for run in runs])
    found["resurfaced"], found["resurfaced_density"] = power(rho, [run["resurfaced"] for run in runs])
    found["dv_density"] = power(rho, [-run["dv_track_mm_s"][0] for run in runs])[1]
    width = [run["hollow_m"][0] / found["hollow_m"] for run in runs]
    stretch = [run["a_over_b"] - given["grains_before"]["a_over_b"] for run in runs]
    found["stretch"], found["stretch_width"] = power(width, stretch)
    found["excess_tangent"] = power(tangent, [run["beta"] - 1.0 for run in rough])[1]
    found["mass_tangent"] = power(tangent, [run["mass_left_kg"] for run in rough])[1]
    ball, craft = given["spacecraft_run"]["ball"], given["spacecraft_run"]["body_and_panels"]
    fewer, less = craft["mass_left_kg"] / ball["mass_left_kg"], (craft["beta"] - 1.0) / (ball["beta"] - 1.0)
    found["mass_spacecraft"] = math.log(fewer) / math.log(less)
    found["volume_m3"] = math.pi / 6.0 * float(np.prod(body["axes_m"]))
    found["momentum"] = given["impact"]["mass_kg"] * given["impact"]["speed_m_s"]
    stays = [found["volume_m3"] * run["density_kg_m3"] - run["mass_left_kg"][0] for run in runs]
    cosines = [
        -1e-3 * run["dv_track_mm_s"][0] * mass / (found["momentum"] * run["beta_track"][0])
        for run, mass in zip(runs, stays)
    ]
    found["cosine_track"] = float(np.mean(cosines))
    # Cheng's own pair, beta 3.61 at 2,400 kg/m^3 and 2.70 mm/s with 1.81e6 m^3, gives his (E . U)(E . t)
    along = 2400.0 * 1.81e6 * 2.70e-3 / found["momentum"]
    found["cosine_ejecta"] = (along - found["cosine_track"]) / 2.61
    return found


def factors(given: Mapping[str, Any], fit: Mapping[str, float]) -> Samples:
    """The factors by name; one of their values may be what was fitted."""
    count = given["prior_samples"]
    raw = uniforms(given["seed"], count * len(given["factor"])).reshape(len(given["factor"]), count)
    f = {}
    for one, u in zip(given["factor"], raw):
        values = [fit[one["name"]] if value == "fit" else value for value in one["values"]]
        f[one["name"]] = valued(one["law"], values, u, one.get("within"))
    return f


def samples(given: Mapping[str, Any]) -> Samples:
    """The factors, and what follows from them, before any observation; by the ``members`` of an ensemble where the
    inputs name a table of them."""
    if "members" in given:
        from studies import hera_ensemble

        return hera_ensemble.samples(given, FOLDER / given["members"])
    fit, body = fits(given), given["body"]
    f = factors(given, fit)
    rho, volume = f["density"], f["volume"]
    rough = np.tan(np.radians(f["friction"])) / math.tan(math.radians(31.0))
    pull = G * rho * volume ** (1.0 / 3.0) * (4.0 * math.pi / 3.0) ** (2.0 / 3.0)  # g = G M / R^2 of the ball
    speed, mu = given["impact"]["speed_m_s"], body["gravity_exponent_mu"]
    turn = rho * speed**2 * (pull * body["projectile_radius_m"] / speed**2) ** (2.0 / (2.0 + mu))
    firm = (1.0 + (f["cohesion"] / turn) ** (1.0 + 0.5 * mu)) ** (-mu / (2.0 + mu))
    # momentum
    excess = fit["excess"] * np.exp(-f["pore_slope"] * (1.0 - rho / body["solid_kg_m3"] - fit["porosity"]))
    excess *= rough ** fit["excess_tangent"] * (1.0 - LATE * (1.0 - firm**MASS_POWER)) * f["spacecraft"]
    excess *= f["blocks"] * f["numerics"] * f["single_draw"]
    # mass and size
    mass_left = fit["mass_left_kg"] * (rho / 2400.0) ** fit["mass_left_kg_density"] * rough ** fit["mass_tangent"]
    mass_left *= f["spacecraft"] ** fit["mass_spacecraft"] * firm**MASS_POWER
    mass_left *= f["late_mass"] * f["handoff_mass"] * f["mass_model"]
    grown = rough ** (fit["mass_tangent"] / 3.0) * f["spacecraft"] ** (fit["mass_spacecraft"] / 3.0) * firm
    grown *= f["hollow_model"]
    wide = fit["hollow_m"] * (rho / 2400.0) ** fit["hollow_m_density"] * grown
    surface = fit["resurfaced"] * (rho / 2400.0) ** fit["resurfaced_density"] * grown**2 * f["surface_model"]
    # shape
    stretch = fit["stretch"] * (wide / fit["hollow_m"]) ** fit["stretch_width"] * f["stretch_model"]
    a_b = np.maximum(f["a_over_b_before"] + stretch, 1.0)
    a_c = np.maximum(f["a_over_c_before"] + f["a_over_c_change"], a_b)
    before = volume * rho
    mass = before - mass_left
    track = 1.0 + f["track"] * excess
    made: Samples = {
        "mass": mass, "density": rho, "volume": mass / rho, "beta_normal": 1.0 + excess, "beta_track": track,
        "beta_ejecta": 1.0 + fit["cosine_track"] * f["track"] * excess / fit["cosine_ejecta"],
        "mass_left": mass_left, "a_over_b": a_b, "a_over_c": a_c, "hollow": wide,
        "deepest": HEIGHT * (wide / WIDE) ** f["depth_power"] * f["depth_model"],
        "resurfaced": np.minimum(surface, 1.0),
    }  # fmt: skip
    made["dv_track"] = fit["momentum"] * fit["cosine_track"] * track / mass
    made |= followed(made, f, fit["momentum"], body)
    made["class"], made["excited"] = classed(wide, volume, f, body), f["excited"]
    return made


def followed(made: Samples, f: Samples, momentum: float, body: Mapping[str, Any]) -> Samples:
    """The change of speed as the period shows it, with its part by the change of shape; and the turn of the orbit."""
    volume = f["volume"]
    change = elongation(made["a_over_b"], made["a_over_c"], volume, body)
    change = change - elongation(f["a_over_b_before"], f["a_over_c_before"], volume, body)
    period = 2.0 * change * f["reshaping"] * 3600.0 * body["period_h"]
    aside = np.where(f["boulders"] > 0.5, f["boulder_momentum"] * f["out_of_plane"], f["lateral_runs"])
    return {
        "dv_observable": made["dv_track"] / (1.0 - f["reshaping_counts"] * period / 1995.0),
        "plane_turned": np.degrees(np.arctan(aside * momentum / (made["mass"] * body["orbital_speed_m_s"]))),
    }


def elongation(a_b: np.ndarray, a_c: np.ndarray, volume: np.ndarray, body: Mapping[str, Any]) -> np.ndarray:
    """e = 0.3 (2 a^2 - b^2 - c^2) / r^2 of half axes with these ratios and this volume: n^2 r^3 = K (1 + e)."""
    a2 = (3.0 * volume * a_b * a_c / (4.0 * math.pi)) ** (2.0 / 3.0)
    return 0.3 * a2 * (2.0 - a_b**-2 - a_c**-2) / body["distance_m"] ** 2


def classed(wide: np.ndarray, volume: np.ndarray, f: Samples, body: Mapping[str, Any]) -> np.ndarray:
    """Index in ``CLASSES``: reshaped where the hollow takes more of the surface than the widest crater, or no edge is
    found all round it."""
    a, b, c = (0.5 * axis for axis in body["axes_m"])
    k = 1.6075  # Thomsen's surface of an ellipsoid, within 1.1 %
    area = 4.0 * math.pi * (((a * b) ** k + (a * c) ** k + (b * c) ** k) / 3.0) ** (1.0 / k)
    area = area * (volume / (4.0 / 3.0 * math.pi * a * b * c)) ** (2.0 / 3.0)
    chance = 1.0 - (1.0 - EDGE_AT_WIDE) * (wide - CERTAIN) / (WIDE - CERTAIN)
    crater = (0.25 * math.pi * wide**2 / area < body["widest_crater"]) & (f["edge"] < chance)
    return np.where(f["neither"] > 0.5, 2.0, np.where(crater, 0.0, 1.0))


def bell(x: np.ndarray, mean: float, sigma: float) -> np.ndarray:
    """The density of a normal law."""
    return np.exp(-0.5 * ((x - mean) / sigma) ** 2) / (sigma * math.sqrt(2.0 * math.pi))


def weights(made: Samples, given: Mapping[str, Any], column: str, without: str = "") -> np.ndarray:
    """Weight of every sample in a column of ``COLUMNS``, ``without`` one of its conditions."""
    seen = given["observed"]
    weight = np.ones_like(made["density"])
    if column != "flat":
        weight = 0.7 * bell(made["density"], *seen["makadia"]["density_kg_m3"])
        weight += 0.3 * bell(made["density"], *seen["old_density"]["density_kg_m3"])
    if without != "dv_track":
        delta_v = seen["dv_track"]
        weight = weight * bell(1e3 * made["dv_observable"], delta_v["value_mm_s"], delta_v["sigma_mm_s"])
    if column == "all_known":
        shape, left = seen["shape"], seen["mass_left"]
        middle = 0.5 * math.log(left["low_kg"] * left["high_kg"])
        weight = weight * bell(made["a_over_b"], *shape["a_over_b"]) * bell(made["a_over_c"], *shape["a_over_c"])
        weight = weight * bell(np.log(made["mass_left"]), middle, left["sigma_ln"])
    return weight


def resampled(made: Samples, weight: np.ndarray, count: int, offset: float) -> Samples:
    """``count`` draws of equal weight, by systematic resampling from one ``offset`` in (0, 1); single precision."""
    steps = np.cumsum(weight)
    chosen = np.searchsorted(steps, (np.arange(count) + offset) * (steps[-1] / count))
    return {name: column[chosen].astype(np.float32) for name, column in made.items()}


def draws(given: Mapping[str, Any]) -> tuple[dict[str, Samples], dict[str, float]]:
    """The draws of every column, and how many independent samples each has."""
    made = samples(given)
    offsets = uniforms(given["seed"] + 1, len(COLUMNS))
    found, worth = {}, {}
    for column, offset in zip(COLUMNS, offsets):
        weight = weights(made, given, column)
        worth[column] = float(weight.sum() ** 2 / (weight**2).sum())
        found[column] = resampled(made, weight, given["draws"], float(offset))
    return found, worth


def main() -> None:
    """The command."""
    from studies import hera_forecast_files as files

    parser = argparse.ArgumentParser(
        prog="python -m studies.hera_forecast", description="Make a frozen forecast, or what its page shows of it."
    )
    parser.add_argument("--name", default="hera_v0")
    parser.add_argument("--out", type=Path, default=FOLDER)
    parser.add_argument("--table", action="store_true", help="print the table of its page and write nothing")
    options = parser.parse_args()
    given = inputs(options.name)
    if options.table:
        print(files.table(tomllib.loads((FOLDER / f"{options.name}.toml").read_text())))
    else:
        files.write(given, options.out)


if __name__ == "__main__":
    main()
