"""The periodic cell and the friction angle measured in it."""

import math

import numpy as np
import pytest

from dem.contact.settings import Contact, GrainLaw
from dem.trials import friction_angle, steady_shear, tilted_bed
from dem.trials.shear_cell import Cell
from matter.errors import InputError, UnphysicalState


def law(friction=0.5, shape=0.3, **more) -> Contact:
    return Contact(shell=GrainLaw(friction=friction, shape=shape, **more))


def loose(contact, count=216, seed=1, **more) -> Cell:
    x, radius, side = steady_shear.sample(count, seed, 0.15)
    length = (2.0 * radius.max() + 0.02) * side
    return Cell(x, radius, np.array([length, length, 1.2 * length]), contact, 100.0, **more)


def test_a_periodic_cell_keeps_its_momentum_and_loses_energy():
    cell = loose(law())
    rng = np.random.default_rng(2)
    cell.W[:, :3] = rng.normal(0.0, 0.3, (216, 3))
    momentum = cell.V[:, 6] @ cell.W[:, :3]
    kinetic = cell.V[:, 6] @ np.sum(cell.W[:, :3] ** 2, axis=1)
    cell.run(4000)
    assert np.abs(cell.V[:, 6] @ cell.W[:, :3] - momentum).max() < 1e-12 * 216
    assert cell.V[:, 6] @ np.sum(cell.W[:, :3] ** 2, axis=1) < 0.8 * kinetic


def test_images_repel_across_the_sliding_border():
    """Two grains that touch through the upper border, whose image is displaced: force, stress and slip are those of
    the pair in the open."""
    contact = law(friction=0.0, restitution=1.0)
    cell = Cell(
        np.array([[0.0, 0.0, 0.2], [0.3, 0.0, 5.3]]), np.array([0.5, 0.5]), np.array([6.0, 6.0, 6.0]), contact, 100.0
    )
    cell.clock[0] = 0.3  # the image above stands 0.3 further along x: below, 0.3 back
    cell._build()
    cell.run(1)
    force = cell.A[0, :3] * cell.V[0, 6]
    np.testing.assert_allclose(force, [0.0, 0.0, 100.0 * 0.1], atol=2e-2)


def test_the_cell_follows_the_normal_stress():
    cell = loose(law())
    cell.pressure, cell.rate = 1.0, 0.05
    cell.run(int(1.0 / cell.rate / cell.dt))
    mean = cell.run(int(1.0 / cell.rate / cell.dt))
    assert mean["zz"] == pytest.approx(1.0, abs=0.05)
    assert 0.45 < mean["fraction"] < 0.66 and 2.0 < mean["coordination"] < 6.0
    assert -mean["xz"] / mean["zz"] > 0.25


@pytest.mark.validation
def test_friction_makes_the_shear_stress_larger():
    """Fast shear of small cells: smooth grains keep an angle below 13 deg, rough ones twice that, and rolling
    resistance adds to it."""
    angles = []
    for contact in (law(0.0, 0.0), law(0.5, 0.0), law(0.5, 0.6)):
        cell = loose(contact, count=343)
        cell.pressure, cell.rate = 1.0, 0.02
        cell.run(int(1.5 / cell.rate / cell.dt))
        mean = cell.run(int(2.0 / cell.rate / cell.dt))
        angles.append(math.degrees(math.atan(-mean["xz"] / mean["zz"])))
    assert 6.0 < angles[0] < 13.0 and 17.0 < angles[1] < 25.0 and angles[2] > angles[1] + 3.0


@pytest.mark.validation
def test_fast_shear_resists_more_and_lies_looser(monkeypatch):
    """At I = 0.6 some 5 deg more than in slow shear (26 deg, 0.58 of space filled), as mu(I) of glass beads rises
    (Jop et al. 2006: 29 for 21 deg); the grains' own motion bears a few per cent of the pressure."""
    monkeypatch.setattr(steady_shear, "LEAST", 0.5)
    monkeypatch.setattr(steady_shear, "MOST", 0.5)
    found = steady_shear.shear(law(0.3, 0.4), count=343, inertial=0.6)
    assert found["inertial"] == 0.6 and found["strain"] == pytest.approx(15.0)
    assert 29.0 < found["angle_deg"] < 35.0 and 0.47 < found["fraction"] < 0.54
    assert 0.01 < found["kinetic_pressure"] < 0.1


@pytest.mark.validation
def test_the_normal_stress_of_fast_shear_counts_what_grains_carry():
    """At I = 1 a twentieth of it is momentum on its way: the cell holds P with both, and no mean motion counts."""
    cell = loose(law(0.3, 0.4), count=216)
    cell.pressure, cell.rate = 1.0, 1.0
    cell.W[:, 0] += 5.0  # a drift of all of them bears nothing
    cell.run(int(60.0 / cell.dt))
    mean = cell.run(int(40.0 / cell.dt))
    kinetic = 2.0 / 3.0 * mean["fluctuation"] * 216 / (cell.period[0] * cell.period[1] * mean["height"])
    assert mean["zz"] == pytest.approx(1.0, abs=0.05) and 0.03 < kinetic < 0.2


def test_a_tilted_bed_flows_and_its_base_slows_it_down(monkeypatch):
    """A small bed, turned quickly: it rests below the friction at its base (20.3 deg in slow shear), which is not that
    of smooth grains."""
    for name, value in (("DEPTH", 6.0), ("WIDTH", 5.0), ("TURN", 0.2)):
        monkeypatch.setattr(tilted_bed, name, value)
    found = tilted_bed.tilt(law(0.5, 0.0), begin=18.0)
    assert found["angle_deg"] == pytest.approx(20.3, abs=2.0) and found["error_deg"] < 2.0
    assert found["stop_deg"] < found["angle_deg"] and 18.0 < found["start_deg"] < 28.0
    assert 16.0 < found["mohr_coulomb_deg"] < 30.0 and found["mohr_coulomb_error_deg"] < 2.0
    assert found["duration"] > 5.0 and 0.5 < found["fraction"] < 0.66


def test_a_burst_cell_is_refused():
    cell = loose(law())
    cell.X[0, :3] = cell.X[1, :3] + 0.3
    cell._build()
    with pytest.raises(UnphysicalState, match="has burst"):
        cell.run(10)


def test_an_angle_is_kept_and_a_friction_found(tmp_path, monkeypatch):
    """With a measurement that is known beforehand: it is made once for each law and seed, and the friction solves for
    the wanted angle."""
    monkeypatch.setenv("BOLIDE_CACHE", str(tmp_path / "kernels"))
    friction_angle.jit.cache_root.cache_clear()
    made = []

    def known(contact, seed=1):
        made.append((contact.shell.friction, seed))
        return {"mohr_coulomb_deg": 24.0 + 10.0 * contact.shell.friction + 0.1 * seed, "mohr_coulomb_error_deg": 0.3}

    monkeypatch.setattr(friction_angle, "shear", known)
    try:
        friction, angle, error = friction_angle.friction_for(30.0, law())
        assert (
            24.0 + 10.0 * friction + 0.15 == pytest.approx(30.0, abs=0.02)
            and angle == pytest.approx(30.0)
            and 0.0 < error < 0.25
        )
        before = len(made)
        contact = Contact.model_validate({"friction_angle": "30 deg", "shell": {"shape": 0.3}})
        assert (
            friction_angle.resolved(contact).shell.friction == friction
            and friction_angle.resolved(contact).friction_angle is None
        )
        assert len(made) == before
        assert friction_angle.resolved(law()) == law()
        with pytest.raises(InputError, match="cannot be reached"):
            friction_angle.friction_for(60.0, law())
        with pytest.raises(InputError, match="least"):
            friction_angle.friction_for(10.0, law())
    finally:
        friction_angle.jit.cache_root.cache_clear()


def test_bad_arguments(capsys, tmp_path):
    assert friction_angle.main(["--inertial", "20"]) == 2
    assert "0.0001 to 10" in capsys.readouterr().err
    assert friction_angle.main(["--inertial", "0.1", "--method", "tilt"]) == 2
    capsys.readouterr()
    assert friction_angle.main(["--friction", "-1"]) == 2
    assert "friction" in capsys.readouterr().err
    assert friction_angle.main(["--case", str(tmp_path)]) == 2
