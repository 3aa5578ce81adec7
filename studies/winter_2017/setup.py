"""Claims W01-W20: bodies, scales, step sizes, initial conditions."""

from __future__ import annotations

import math

import numpy as np

from nbody.masses.system import jovian, load
from nbody.population import conditions, encounters
from nbody.population.encounters import COLLISION, ENTRY
from studies.winter_2017.score import Evidence, Score, all_met, close

G = 6.6743e-11
AU = 1.495978707e11


def inputs(_: Evidence) -> list[Score]:
    """W01-W12: bodies, craters' scale laws, what was put into the code."""
    c, g = load("callisto"), load("ganymede")
    mass, gravity, density = c.gm / G, c.gm / c.radius**2, c.gm / G / (4.0 / 3.0 * math.pi * c.radius**3)
    mu = load("jupiter").gm
    period = [2.0 * math.pi * math.sqrt(m.semi_major_axis**3 / (mu + m.gm)) / 86400.0 for m in (g, c)]
    duration = math.sqrt(980e3 / gravity) / 60.0
    printed, conserved = _collapse(0.5)
    return [
        Score("W01", "Callisto: R, density, mass, g", "2410.3 km; 1834.4 kg/m3; 1.076e23 kg; 1.236 m/s2",
              f"{c.radius / 1e3:.1f} km; {density:.1f}; {mass:.4g}; {gravity:.4f}", "0.2 %",
              all_met(close(density, 1834.4, 2e-3), close(mass, 1.076e23, 2e-3), close(gravity, 1.236, 2e-3))),
        Score("W02", "Callisto: a, e, i, P", "1,882,700 km; 0.007; 0.192 deg; 16.69 d",
              f"{c.semi_major_axis / 1e3:,.0f} km; 0; 0; {period[1]:.3f} d", "input", close(period[1], 16.69, 2e-3),
              "e and i neglected, as in section 2.2.1"),
        Score("W03", "period ratio Callisto : Ganymede is 7:3", "16.69/7.16 = 2.331; 7/3 = 2.333",
        f"{period[1] / period[0]:.4f}", "0.2 %",
              close(period[1] / period[0], 7.0 / 3.0, 2e-3)),
        Score("W04", "four interior models", "table 2", "not used here", "input", "input"),
        Score("W05", "places of Valhalla, Asgard, Utgard, Adlinda", "table 3",
        "Valhalla 14.7 N, Asgard 32.2 N: windows of +-10 deg", "input", "input"),
        Score("W06", "zones of Valhalla", "350; 600-800; 300; 200; 600 km", "not used here", "input", "input"),
        Score("W07", "rim and ejecta diameters", "980, 1800; 350, 800 km", "not used here", "input", "input"),
        Score("W08", "t = sqrt(D/g), D = 980 km", "14.8 min", f"{duration:.2f} min", "0.5 %", close(duration, 14.8,
        5e-3)),
        Score("W09", "eq. 1: D_cp = 1.45 exp(0.028 D)", "-", f"D = 350 km gives {1.45 * math.exp(0.028 * 350):.3g} "
                                                             f"km", "outside its range",
              "arithmetic", "not usable above about 150 km"),
        Score("W10", "eq. 3: D_t^3 H_t", "as printed", f"printed/conserved volume at D_f/D = 0.5, D = 980 km: "
                                                       f"{printed / conserved:.3g} km",
              "as printed + warn", "arithmetic", "the printed form has one length too many: a volume needs D^2 H"),
        Score("W11", "massive bodies, coplanar, present orbits, no "
                     "atmospheres", "Sun, Jupiter, Ganymede, Callisto", "the same", "exact", "met"),
        Score("W12", "RKCK 4(5), eps = 1e-11, tolerances", "0.5 m; 1e-7 m/s", _tolerances(), "same rule", "met",
              "same rule; the printed 3.5 AU is not the mean over all pairs of five bodies"),
    ]  # fmt: skip


def _collapse(floor: float) -> tuple[float, float]:
    """Eq. 3's right-hand side over H [km^3] as printed, and D_t^2 H_t / H from conserved volume [km^2], D = 980 km,
    floor D_f = ``floor`` D."""
    d = 980.0
    return 5.0 * d**3 / (1.0 + 6.0 / (1.0 + floor + floor**2)), 2.0 / 3.0 * d**2 * (1.0 + floor + floor**2)


def _tolerances() -> str:
    a = load("jupiter").semi_major_axis
    mean = 4.0 * a / 10.0  # four of ten pairs contain the Sun, the others are small
    return f"mean distance {mean / AU:.2f} AU: {0.1e-11 * mean:.2f} m; 1e-7 m/s at 11 km/s"


def integration(e: Evidence) -> list[Score]:
    """W13-W15."""
    found, verdict, note = "no census with rkck given", "not met", ""
    if e.literal is not None:
        table, attributes = e.literal
        hit = encounters.select(table, (table["event"] == COLLISION) & (table["direct"] == 0))
        minutes = np.percentile((hit["time"] - _entry_times(table))[np.isfinite(hit["time"])] / 60.0, [5, 95])
        low, high = np.percentile(hit["step"], [5, 95])
        steps = attributes["steps_per_flight"]
        found = (
            f"{steps / 1e3:.1f}k steps in 1.4 yr; moon mode {minutes[0]:.0f}-{minutes[1]:.0f} min, last step "
            f"{low:.1f}-{high:.1f} s (5-95 %)"
        )
        verdict = close(steps, 81e3, 0.5)
        note = "the printed tolerances give 4 to 5 times fewer steps; durations and moon-mode steps agree"
    planet = jovian("callisto")
    hill, moons = planet.start_radius / AU, planet.hill_radii / AU
    return [
        Score("W13", "accumulated error of 81k steps", "121.5 km; 0.009 m/s",
        "0.5 m x 81k = 40.5 km (x 3 = 121.5); 1e-7 x 81k = 0.0081 m/s",
              "-", "arithmetic", "an upper bound with a factor 3 for positions only; against IAS15 the error is some "
                                 "10 m"),
        Score("W14", "steps 81k (moon mode 400), 1.4 yr and 15-130 "
                     "min", "81k; 15-130 min", found, "factor 2 in steps", verdict, note),
        Score("W15", "Hill radii", "0.338 AU; 2.12e-4 (Ganymede), 3.35e-4 AU",
        f"{hill:.5f}; {moons[0]:.3e}, {moons[1]:.3e} AU", "0.3 %",
              all_met(close(hill, 0.338, 3e-3), close(moons[0], 2.12e-4, 3e-3), close(moons[1], 3.35e-4, 3e-3))),
    ]  # fmt: skip


def _entry_times(table: dict[str, np.ndarray]) -> np.ndarray:
    """Entry time of each constructed collision (same particle and moon; NaN where a particle entered twice)."""
    seen: dict[tuple[int, int], list[float]] = {}
    entry = table["event"] == ENTRY
    for key in zip(table["particle"][entry], table["moon"][entry], table["time"][entry]):
        seen.setdefault((int(key[0]), int(key[1])), []).append(float(key[2]))
    hit = (table["event"] == COLLISION) & (table["direct"] == 0)
    pick = [seen[int(p), int(m)] for p, m in zip(table["particle"][hit], table["moon"][hit])]
    return np.array([times[0] if len(times) == 1 else math.nan for times in pick])


def starts(_: Evidence) -> list[Score]:
    """W16-W20: initial conditions."""
    from nbody.integrators import fast

    system = jovian("callisto")
    batch = conditions.batch(system, conditions.population("printed"), 1, 0)
    position = np.linalg.norm(batch.state[:, :3] - batch.start.position[1], axis=1) / system.start_radius
    arrivals = int((fast.run(system, batch, 1.4 * conditions.YEAR).table["event"] == ENTRY).sum())
    mu, a = load("sun").gm, 5.2 * AU
    planet = math.sqrt(mu / a)
    outer = math.sqrt(mu * (2.0 / a - (1.0 - 0.1) / a)), math.sqrt(mu * (2.0 / a - (1.0 + 0.1) / a))
    slope = _printed_crossing()

    def chord(inclination: float) -> float:
        """Eq. 11 [m/s]."""
        return 2.0 * planet * math.sin(math.radians(0.5 * inclination))

    literal = conditions.batch(system, conditions.population("literal"), 1, 0)
    v = np.abs((literal.state[:, 3:] - literal.start.velocity[1]) @ conditions.triad(literal.start).T).max(axis=0)
    return [
        Score("W16", "eq. 6: start between 95 % and 100 % of the Hill radius", "each coordinate +-(0.95 ... 1)",
              f"as printed: {position.min():.2f}-{position.max():.2f} Hill radii, {arrivals} of {len(position)} reach "
              f"a moon", "both implemented", "met",
              "populations 'printed' and 'literal'; the latter reads it as a shell, because as printed nothing "
              "arrives"),
        Score("W17", "largest tangential speed difference", "0.64; 0.67 km/s",
        f"{abs(outer[0] - planet) / 1e3:.3f}; {abs(planet - outer[1]) / 1e3:.3f} km/s",
              "1 %", all_met(close(abs(outer[0] - planet), 640.0, 1e-2), close(abs(planet - outer[1]), 670.0, 1e-2)),
              "vis-viva with a = r/(1 -+ e)"),
        Score("W18", "largest radial speed difference", "65 m/s (0.29 deg)",
              f"printed equations: {np.degrees(slope):.2f} deg, {planet * math.tan(slope):.0f} m/s; right: "
              f"{0.1 * planet:.0f} m/s", "literal mode only",
              close(planet * math.tan(slope), 65.0, 0.05), "eqs. 9, 10 put the centre of the ellipse, not its focus, "
                                                           "on the Sun: 20 times too small"),
        Score("W19", "largest vertical speed difference, eq. 11, i = 10 deg", "4.534 km/s",
              f"2 x 13.06 sin 5 deg = {chord(10) / 1e3:.3f}; with i = 20 deg {chord(20) / 1e3:.3f} km/s",
              "literal mode only", close(chord(20), 4534.0, 2e-3), "a factor two: the value of i = 20 deg"),
        Score("W20", "start velocities uniform in (670, 65, 4534) m/s within 15 deg of Jupiter", "exact",
              f"radial {v[0]:.1f}, orbital {v[1]:.1f}, vertical {v[2]:.0f} m/s at most among "
              f"{len(literal.state)}", "exact", "met",
              "position kept, velocity redrawn; slow ones survive the cone, so typical starts are 0.1-0.4 km/s"),
    ]  # fmt: skip


def _printed_crossing() -> float:
    """Largest angle [rad] between circle and ellipse of eqs. 9 and 10, both centred on the Sun, e = 0.1: atan(e^2 / (2
    sqrt(1 - e^2))).

    With the printed mean semi-major axis (5.25 AU) the ellipse encloses Jupiter's circle, so that the curves do not
    even meet.
    """
    return math.atan(0.1**2 / (2.0 * math.sqrt(1.0 - 0.1**2)))
