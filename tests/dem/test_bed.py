"""The settled bed: at rest, as heavy as the body, and indifferent to losing its headroom."""

import json

import numpy as np
import pytest

from dem.beds import bed_walls, settling, stage
from dem.beds.layered_body import LayeredBody
from dem.grains.assembly import Assembly
from matter.errors import InputError
from matter.files import snapshot
from matter.geometry.ground_region import Cone
from tests.dem import bodies
from tests.dem.stops import interrupted, same_grains


@pytest.fixture(scope="module")
def report(bed_run):
    return json.loads((bed_run / "3_bed" / "bed_report.json").read_text())


@pytest.fixture(scope="module")
def bed(bed_run):
    return snapshot.read(bed_run / "3_bed" / "bed.vtkhdf")


def test_it_is_at_rest(report, bed):
    assert report["residual_speed_over_sqrt_g_r"]["rms"] < 1e-3
    assert 0.0 < report["free_run_speed_over_sqrt_g_r"] < 1e-3
    assert bed.attributes["residual_speed_over_sqrt_g_r"] == report["free_run_speed_over_sqrt_g_r"]


def test_it_weighs_what_the_body_weighs(report):
    assert abs(report["mass_error"]) < 0.01
    assert report["floor_pressure_Pa"] == pytest.approx(report["floor_pressure_target_Pa"], rel=0.03)
    profile = report["profile"]
    radial, target = np.array(profile["radial_stress_Pa"]), np.array(profile["pressure_target_Pa"])
    assert np.abs(radial / target - 1.0)[target > 5e7].max() < 0.06


def test_density_follows_the_body(report):
    # 3 % at the size of a shipped bed; here the whole bed is seven grains deep
    assert report["density_error_max"] < 0.05
    assert 0.6 < report["packing_fraction"] < 0.74


def test_layers_lie_where_they_belong(bed):
    distance = np.linalg.norm(bed.position, axis=1)
    ocean = bed.species == bed.attributes["species"].index("ocean")
    assert distance[ocean].max() < 1980e3 and distance[~ocean].min() > 1910e3
    assert set(np.unique(bed.material[ocean])) == {bed.attributes["materials"].index("water")}
    assert np.array_equal(bed.headroom == 1, distance > bed.attributes["domain"]["datum_radius_m"] + 0.0) or (
        np.mean((bed.headroom == 1) != (distance > bed.attributes["domain"]["datum_radius_m"])) < 0.02
    )


def test_radii_are_uniform_in_their_range(bed):
    shape = bed.radius / bed.radius.mean()
    assert shape.min() > 0.84 and shape.max() < 1.16
    assert np.histogram(shape, bins=6)[0].std() < 0.15 * len(shape) / 6


def assembled(bed_run, bed, keep=None):
    particles = bed if keep is None else bed.select(keep)
    particles.tables.update(bed.tables)
    body = LayeredBody.read(bed_run / "2_sph" / "target.json")
    domain = Cone.of_attribute(bed.attributes["domain"])
    from dem.contact.settings import Contact

    return Assembly(particles, Contact(), bed_walls.walls(domain), body.gravity())


def test_carved_at_the_datum_it_keeps_still(bed_run, bed):
    carved = assembled(bed_run, bed, bed.headroom == 0)
    fastest = 0.0
    for _ in range(150):  # one travel time of a wave and a half, the time in which released stress would show
        carved.step()
        fastest = max(fastest, carved.speed)
    assert fastest < 1.0


def test_with_its_weightless_headroom_it_keeps_still(bed_run, bed):
    whole = assembled(bed_run, bed)
    whole.weight[:] = np.where(whole.headroom > 0, 0.0, 1.0)
    start = whole.particles({})
    for _ in range(300):
        whole.step()
    moved = np.linalg.norm(whole.particles({}).position - start.position, axis=1)
    assert moved.max() < 0.05 * bed.radius.mean()


def test_the_headroom_touches_without_load(bed_run, bed):
    from dem.beds import bed_measures

    whole = assembled(bed_run, bed)
    first, second, _, _, overlap = bed_measures.contact_forces(whole)
    mixed = (whole.headroom[first] > 0) | (whole.headroom[second] > 0)
    assert overlap[mixed].max() < 2e-3


def test_grains_do_not_lie_in_layers_along_the_datum(bed):
    """Of the grain centres within a quarter radius of the datum there are as many as elsewhere, a quarter less at
    most; half of them where the weight of packing grains ended at the datum."""
    domain = Cone.of_attribute(bed.attributes["domain"])
    r = bed.radius.mean()
    inner = domain.side_depth(bed.position) > 3.0 * r
    height = (domain.height(bed.position)[inner] - domain.datum) / r
    usual = ((height > -5.0) & (height < -2.0)).sum() / 3.0
    assert (np.abs(height) < 0.25).sum() / (0.5 * usual) > 0.75


def test_a_stopped_bed_resumes_bit_for_bit(tmp_path, bed_settings, monkeypatch):
    settings = bed_settings.model_copy(update={"count": 300, "arc_radius": 5e5})
    files = []
    for name, stops in (("whole", ()), ("resumed", (3, 150, 500, 650))):
        run = tmp_path / name
        bodies.write_callisto(run / "2_sph" / "target.json")
        out = run / "3_bed"
        out.mkdir()
        interrupted(monkeypatch, stops, lambda run=run, out=out: stage.run(settings, run, out))
        files.append(snapshot.read(out / "bed.vtkhdf"))
        assert len(list(out.glob("checkpoint_*"))) <= 1
    same_grains(*files)


def test_bad_settings_and_inputs(tmp_path, bed_settings):
    with pytest.raises(InputError, match=r"no target\.json"):
        stage.run(bed_settings, tmp_path, tmp_path)
    bodies.write_callisto(tmp_path / "2_sph" / "target.json")
    for change, words in (
        ({"depth": 3e6}, "reaches the body's centre"),
        ({"arc_radius": 5e6}, "below a quarter of the circumference"),
    ):
        with pytest.raises(InputError, match=words):
            stage.run(bed_settings.model_copy(update=change), tmp_path, tmp_path)
    (tmp_path / "2_sph" / "target.json").write_text('{"radius_m": 1}')
    with pytest.raises(InputError, match=r"lacks layers, profile"):
        stage.run(bed_settings, tmp_path, tmp_path)


def test_prediction_grows_with_the_bed(bed_settings):
    small, large = (stage.predict(bed_settings.model_copy(update={"count": n})) for n in (20_000, 100_000))
    assert all(large[key] > small[key] > 0 for key in ("wall_s", "memory_bytes", "disk_bytes"))
    assert settling.threads_for(100) == 1
