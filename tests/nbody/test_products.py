"""Analytic limits, the tube estimator against theory, and what a census leaves on disk."""

import csv
import json
import math

import numpy as np
import pytest

from matter.errors import InputError
from nbody.census import census, moon_hits
from nbody.integrators import fast, tube
from nbody.masses import system
from nbody.population import conditions, encounters
from nbody.results import analytic, census_tables
from studies import encounter_claims
from studies.winter_2017.score import Evidence


def test_limits_as_printed_and_in_quadrature():
    """Winter 2017, section 2.3.3: 29.0/7.2 and 22.2/5.8 km/s; in quadrature 26.4/5.3 and 20.0/4.2."""
    for moon, printed, quadrature in (("ganymede", (7.2, 29.0), (5.3, 26.4)), ("callisto", (5.8, 22.2), (4.2, 20.0))):
        body = system.load(moon)
        assert np.array(analytic.speed_limits(body, False)) / 1e3 == pytest.approx(printed, abs=0.06)
        assert np.array(analytic.speed_limits(body, True)) / 1e3 == pytest.approx(quadrature, abs=0.06)


def test_beam_model_gives_table_7():
    """One width explains the mean angle in all bands of latitude: no n-body needed (+-1 deg below 60, +-3 above)."""
    angle, share = analytic.beam_angles(np.radians(census_tables.BANDS))
    published = np.array([39.27, 42.18, 46.31, 53.38, 56.81, 59.4])
    assert (np.abs(np.degrees(angle) - published) < [1, 1, 1, 1.1, 3, 3]).all()
    assert share.sum() == pytest.approx(1.0)
    wide, _ = analytic.beam_angles(
        np.radians(census_tables.BANDS), sigma=100.0 * math.pi
    )  # uniform elevation: more beams from the poles
    assert np.degrees(wide)[0] > 45.0


def test_beam_model_of_isotropic_radiants_is_45_degrees():
    rng = np.random.default_rng(1)
    up, radiant = conditions.directions(200_000, rng), conditions.directions(200_000, rng)
    cosine = np.einsum("ij,ij->i", up, radiant)
    seen = cosine > 0
    assert np.degrees(np.average(np.arccos(cosine[seen]), weights=cosine[seen])) == pytest.approx(45.0, abs=0.2)


@pytest.fixture(scope="module")
def isotropic():
    jovian, population = census.jovian("callisto"), conditions.population("isotropic")
    made = []
    for chunk in range(6):
        batch = conditions.batch(jovian, population, 5, chunk)
        flights = tube.run(jovian, batch, population.duration, 5)
        made += [flights.table, moon_hits.collide(flights.table, jovian, 5, chunk, focused=True)]
    return jovian, encounters.join(made)


def isotropic_encounters(moon: system.Body, v_infinity: float) -> tuple[float, float]:
    """Mean impact speed [m/s] and leading/trailing ratio of impacts (per hemisphere) for isotropic arrivals at the
    planet.

    Straight-line encounter at the orbit: speed v_p^2 = v_infinity^2 + 2 GM_p/a with isotropic directions, relative
    speed u, rate proportional to u (1 + v_esc^2/u^2), v_imp^2 = u^2 + v_esc^2. A beam from the direction at angle psi
    off the apex puts the fraction (1 + cos psi)/2 of its impacts on the leading hemisphere.
    """
    planet, orbit, own = (
        system.load(moon.around),
        analytic.orbital_speed(moon),
        analytic.escape_speed(moon.gm, moon.radius),
    )
    fall = math.sqrt(v_infinity**2 + analytic.escape_speed(planet.gm, moon.semi_major_axis) ** 2)
    mu = np.linspace(-1.0, 1.0, 20001)  # cosine between the particle's and the moon's motion
    u = np.sqrt(fall**2 + orbit**2 - 2.0 * fall * orbit * mu)
    rate = u * (1.0 + (own / u) ** 2)
    speed = np.sqrt(u**2 + own**2)
    radiant = (orbit - fall * mu) / u  # cosine between radiant and apex
    lead = 0.5 * (1.0 + radiant)
    return float((rate * speed).sum() / rate.sum()), float((rate * lead).sum() / (rate * (1.0 - lead)).sum())


@pytest.mark.parametrize("moon", [pytest.param("ganymede", marks=pytest.mark.validation), "callisto"])
@pytest.mark.validation
def test_isotropic_arrivals_have_the_analytic_speed_and_asymmetry(isotropic, moon):
    jovian, table = isotropic
    mean, ratio = isotropic_encounters(system.load(moon), conditions.ISOTROPIC_SPEED)
    found = census_tables.classes(table, jovian.moon(moon))["mean"]
    assert found.value == pytest.approx(mean, abs=4.0 * found.standard_error) and found.standard_error < 0.02 * mean
    side = census_tables.asymmetry(table, jovian.moon(moon))["all"]
    assert side.value == pytest.approx(ratio, abs=4.0 * side.standard_error) and side.standard_error < 0.15 * ratio


@pytest.mark.validation
def test_tube_and_fast_give_the_same_number_of_entries():
    """Same particles, two estimators: entries per particle at Callisto agree within the counting error."""
    jovian, population = census.jovian("callisto"), conditions.population("isotropic")
    count = expected = 0.0
    for chunk in range(4):
        batch = conditions.batch(jovian, population, 6, chunk)
        quick = fast.run(jovian, batch, population.duration).table
        count += ((quick["event"] == encounters.ENTRY) * quick["weight"]).sum()
        weighted = tube.run(jovian, batch, population.duration, 6).table
        expected += (weighted["weight"] * (weighted["event"] == encounters.ENTRY)).sum()
    assert count > 25 and count == pytest.approx(expected, abs=4.0 * math.sqrt(expected))


def test_corrected_population_is_the_flux_of_its_orbits():
    """Against brute force: orbits with random elements, kept where they happen to be near the Hill sphere, weighted by
    inward speed."""
    from scipy.stats import ks_2samp

    jovian = census.jovian("callisto")
    batch = conditions.batch(jovian, conditions.population("corrected", mean_anomaly=0.0), 3, 0)
    home, motion = batch.start.position[1] - batch.start.position[0], batch.start.velocity[1] - batch.start.velocity[0]
    rng, mu, radius = np.random.default_rng(2), jovian.sun.gm, jovian.start_radius
    kept = []
    for _ in range(6):
        n = 300_000
        a = rng.uniform(0.8, 1.25, n) * np.linalg.norm(home)
        e, i = rng.uniform(0, 0.1, n), rng.uniform(0, math.radians(10), n)
        node, peri = rng.uniform(0, 2 * math.pi, (2, n))
        mean = (
            rng.uniform(-0.35, 0.35, n) - node - peri
        )  # only those near Jupiter's longitude (0) can be close: |2 e| + 0.07 rad
        big = mean.copy()
        for _ in range(12):
            big = mean + e * np.sin(big)
        p, q = a * (np.cos(big) - e), a * np.sqrt(1 - e * e) * np.sin(big)
        rate = np.sqrt(mu / a**3) * a / (1 - e * np.cos(big))
        vp, vq = -rate * np.sin(big), rate * np.sqrt(1 - e * e) * np.cos(big)

        def turned(x, y, w=peri, o=node, i=i):
            x, y = x * np.cos(w) - y * np.sin(w), x * np.sin(w) + y * np.cos(w)
            z, y = y * np.sin(i), y * np.cos(i)
            return np.stack([x * np.cos(o) - y * np.sin(o), x * np.sin(o) + y * np.cos(o), z], axis=1)

        place, speed = turned(p, q) - home, turned(vp, vq) - motion
        distance = np.linalg.norm(place, axis=1)
        inward = -np.einsum("ij,ij->i", place, speed) / distance
        good = (np.abs(distance / radius - 1.0) < 0.06) & (rng.random(n) * 4000.0 < inward)
        kept.append(speed[good])
    brute = np.concatenate(kept)
    assert len(brute) > 800
    drawn = batch.state[:, 3:] - batch.start.velocity[1]
    for k in range(3):
        assert ks_2samp(brute[:, k], drawn[:, k]).pvalue > 1e-3


@pytest.mark.validation
def test_census_leaves_tables_and_pictures(tmp_path, capsys):
    assert census.census("callisto", "literal", "tube", 300, 2, tmp_path) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == str(tmp_path) and "callisto" in printed[-1]
    table, _ = encounters.read(tmp_path / "encounters.h5")
    hit = census_tables.hits(table, 1)
    with (tmp_path / "table_05_subsets.csv").open() as file:
        row = next(line for line in csv.DictReader(file) if line["moon"] == "callisto")
    assert float(row["prograde"]) + float(row["retrograde"]) == pytest.approx(hit["weight"].sum(), rel=1e-4)
    with (tmp_path / "figure_15_impacts_over_speed.csv").open() as file:
        bars = [line for line in csv.DictReader(file) if line["moon"] == "callisto" and "grade" in line["subset"]]
    assert sum(float(line["weight"]) for line in bars) == pytest.approx(hit["weight"].sum(), rel=1e-4)
    assert all(
        (tmp_path / f"{name}.png").stat().st_size > 10_000
        for name in ("figure_14_events_over_speed", "figure_18_basin_angles")
    )
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert 17_000 < summary["moons"]["callisto"]["v2_retrograde_mean"]["value"] < 19_000
    # again: nothing is flown twice
    before = (tmp_path / "encounters.h5").stat().st_mtime_ns
    census.census("callisto", "literal", "tube", 300, 2, tmp_path)
    assert (tmp_path / "encounters.h5").stat().st_mtime_ns == before


@pytest.mark.validation
def test_population_from_a_file_is_the_isotropic_one_at_its_elevations(tmp_path):
    path = tmp_path / "comets.csv"
    path.write_text("# comets\nspeed_at_infinity_km_s,inclination_deg,weight\n5,0,1\n8,60,3\n")
    jovian, population = census.jovian("io"), conditions.population(str(path))
    batch = conditions.batch(jovian, population, 1, 0)
    assert len(jovian.moons) == 3
    flights = tube.run(jovian, batch, population.duration, 1)
    made = moon_hits.collide(flights.table, jovian, 1, 0, focused=True)
    assert (census_tables.hits(made, jovian.moon("io"))["speed"] > 0).any()


def test_bad_requests_have_one_clear_message(tmp_path):
    for arguments, message in (
        (("calisto", "literal", "fast", 5, 1), "did you mean 'callisto'"),
        (("callisto", "literal", "fast", -5, 1), "count = -5"),
        (("callisto", "comets.csv", "fast", 5, 1), "unknown population"),
        (("callisto", "literal", "fst", 5, 1), "unknown integrator"),
        (("jupiter", "literal", "fast", 5, 1), "not a moon of Jupiter"),
    ):
        with pytest.raises(InputError, match=message):
            census.census(*arguments, tmp_path)


def test_every_claim_is_scored_once():
    jovian, population = census.jovian("callisto"), conditions.population("literal")
    made = []
    for chunk in range(2):
        batch = conditions.batch(jovian, population, 9, chunk)
        flights = tube.run(jovian, batch, population.duration, 9)
        made += [flights.table, moon_hits.collide(flights.table, jovian, 9, chunk, focused=False)]
    attributes = {"particles": 16384, "population": "literal", "integrator": "tube", "seed": 9}
    scores = encounter_claims.score(Evidence(encounters.join(made), attributes, None))
    assert [s.id for s in scores] == [f"W{n:02d}" for n in range(1, 38)]
    assert {s.verdict for s in scores} <= {"met", "not met", "input", "arithmetic"}
    assert all(s.verdict == "met" for s in scores if s.id in ("W01", "W03", "W15", "W17", "W18", "W19", "W31", "W32"))
