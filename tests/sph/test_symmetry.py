"""A half and a quarter of an impact beside the whole made by unfolding them."""

import math

import numpy as np
import pytest

from matter.case.body import Impact, Layer, Projectile, Target
from matter.points.regions import Cut, Slab
from sph import simulation
from sph.bodies import symmetry
from sph.bodies.target import Body
from sph.settings import Settings
from sph.stepping import gravity_field

ELLIPSOID = Target(
    shape="ellipsoid",
    axes=(80.0, 70.0, 60.0),
    layers=({"name": "rock", "material": "basalt"},),  # type: ignore[arg-type]
)
BODY = {
    "target": Target(layers=(Layer(name="ice", material="ice", thickness=300e3),)),
    "impact": Impact(
        speed=5e3,
        angle_from_vertical=0.0,
        projectile=Projectile(material="ice", radius=30e3),
        expected_transient_diameter=200e3,
    ),
    "spacing_at_impact": 30e3, "spacing_far": 50e3, "fine_radius": 100e3, "contact_radius": 60e3,
    "contact_refinement": 1.2, "relaxation_time": 0.0, "gravity_shift": 0.0, "first_step": 0.1,
    "end_time": 1e3, "snapshot_interval": 1e3, "history_interval": 500.0,
}  # fmt: skip
"""A body that pulls itself."""


def settings(of: str, angle: float = 0.0, **more) -> Settings:
    target = Target(
        layers=(Layer(name="rock", material="basalt", thickness=30.0),), shape="half_space", gravity=9.81, width=60.0
    )
    impact = Impact(
        speed=5e3,
        angle_from_vertical=math.radians(angle),
        projectile=Projectile(material="basalt", radius=2.0),
        expected_transient_diameter=30.0,
    )
    chosen = {
        "target": target, "impact": impact, "symmetry": of, "spacing_at_impact": 2.0, "spacing_far": 5.0,
        "fine_radius": 8.0, "contact_radius": 4.0, "contact_refinement": 1.5, "end_time": 5e-3,
        "snapshot_interval": 5e-3, "history_interval": 2.5e-3,
    }  # fmt: skip
    chosen |= more
    chosen["impact"] = chosen["impact"].model_copy(update={"angle_from_vertical": math.radians(angle)})
    return Settings(**chosen)


def begun(chosen: Settings, folder) -> simulation.Simulation:
    folder.mkdir(exist_ok=True)
    job = simulation.Simulation(chosen, folder)
    job.begin()
    return job


def unfolded(part: Body, of: str) -> Body:
    turned = symmetry.signs(of)
    n = len(turned)
    distention = np.broadcast_to(part.distention, len(part.mass))
    return Body(
        np.concatenate([part.position * s for s in turned]),
        *(np.tile(values, n) for values in (part.mass, part.density, part.h, part.layer, part.material, distention)),
    )


def whole_of(half: Settings, folder, monkeypatch) -> tuple[simulation.Simulation, simulation.Simulation, np.ndarray]:
    """The part, the whole with its particles and flaws mirrored, and the identity in the part of each of the whole."""
    parts: list[Body] = []
    room = simulation.grounds if half.target.flat else simulation.bodies
    made, thrown, seeded = room.build, simulation.projectile.build, simulation.seeding.seed_flaws
    kept = {}

    def keep(function):
        def inner(*arguments, **named):
            parts.append(function(*arguments, **named))
            return parts[-1]

        return inner

    monkeypatch.setattr(room, "build", keep(made))
    monkeypatch.setattr(simulation.projectile, "build", keep(thrown))
    monkeypatch.setattr(
        simulation.seeding,
        "seed_flaws",
        lambda cloud, rows, seed: (seeded(cloud, rows, seed), kept.update(cloud.state()), kept.pop("position")),
    )
    part = begun(half, folder / "part")
    ground, ball = parts
    of, n = half.symmetry, symmetry.copies(half.symmetry)
    first, second = len(ground.mass), len(ball.mass)
    source = np.concatenate([np.tile(np.arange(first), n), np.tile(first + np.arange(second), n)])

    def flaws(cloud, rows, seed):
        place, origin = np.argsort(cloud.identity), np.argsort(kept["identity"])
        for name in ("flaw_first", "flaw_last", "root_damage"):
            getattr(cloud, name)[place] = kept[name][origin][source]
        cloud.flaw_strain = kept["flaw_strain"]

    monkeypatch.setattr(room, "build", lambda *_, **__: unfolded(ground, of))
    monkeypatch.setattr(simulation.projectile, "build", lambda *_, **__: unfolded(ball, of))
    monkeypatch.setattr(simulation.seeding, "seed_flaws", flaws)
    whole = begun(half.model_copy(update={"symmetry": "none"}), folder / "whole")
    return part, whole, source


def slow(*values):
    return pytest.param(*values, marks=pytest.mark.validation)


@pytest.mark.parametrize(
    "of,angle,more",
    [
        slow("half", 40.0, {}),
        ("quarter", 0.0, {}),
        slow("half", 40.0, {"numerics": "reconstructed"}),
        slow("half", 40.0, {"sides": "free", "floor": "wall"}),
        ("half", 40.0, BODY),
        ("quarter", 0.0, BODY),
    ],
)
def test_a_part_moves_as_the_whole(of, angle, more, tmp_path, monkeypatch):
    monkeypatch.setattr(gravity_field, "THETA", 0.1)  # what the tree gets wrong is no mirror image
    part, whole, source = whole_of(settings(of, angle, **more), tmp_path, monkeypatch)
    spacing = part.settings.zones.contact
    assert len(whole.integrator.cloud) == symmetry.copies(of) * len(part.integrator.cloud)
    for _ in range(200):
        dt = part.integrator.next_step(1e9)
        assert whole.integrator.next_step(1e9) == pytest.approx(dt, rel=1e-9)
        part.integrator.step(dt)
        whole.integrator.step(dt)
    mine, theirs = part.integrator.cloud, whole.integrator.cloud
    at, there = np.argsort(mine.identity), np.argsort(theirs.identity)
    wanted = np.abs(mine.position[at][source])
    axes = list(symmetry.MIRRORS[of])
    found = theirs.position[there].copy()
    assert (mine.position[:, axes] > 0.0).all()
    off = np.linalg.norm(np.abs(found) - wanted, axis=1)
    assert off.max() < 1e-6 * spacing, off.max() / spacing
    heat = theirs.specific_energy[there]
    assert np.abs(heat - mine.specific_energy[at][source]).max() < 1e-6 * heat.max()
    assert np.linalg.norm(mine.velocity, axis=1).max() > 100.0


def test_what_is_written_is_the_whole(tmp_path, monkeypatch):
    part, whole, _ = whole_of(settings("half", 40.0), tmp_path, monkeypatch)
    mine, theirs = part.particles(), whole.particles()
    assert len(mine) == len(theirs)
    assert len(np.unique(mine.identity)) == len(mine)
    for _ in range(40):
        dt = part.integrator.next_step(1e9)
        part.integrator.step(dt)
        whole.integrator.step(dt)
    mine, theirs = part.particles(), whole.particles()
    by = [np.lexsort(np.round(one.initial_position, 6).T) for one in (mine, theirs)]
    for name in (
        "position",
        "velocity",
        "mass",
        "pressure",
        "deviatoric_stress",
        "damage",
        "initial_position",
        "gravity",
    ):
        one, other = mine[name][by[0]], theirs[name][by[1]]
        assert one == pytest.approx(other, rel=1e-6, abs=1e-6 * max(float(np.abs(other).max()), 1e-300)), name
    part.history.add(part.integrator)
    whole.history.add(whole.integrator)
    one, other = part.history.rows[-1], whole.history.rows[-1]
    for name in ("mass_kg", "kinetic_J", "internal_J", "gravitational_J", "ejected_mass_kg", "damaged_mass_kg"):
        assert one[name] == pytest.approx(other[name], rel=1e-9), name
    for kind in ("momentum", "angular_momentum"):
        scale = max(abs(other[f"{kind}_{axis}"]) for axis in "xyz")
        for axis in "xyz":
            assert one[f"{kind}_{axis}"] == pytest.approx(other[f"{kind}_{axis}"], abs=1e-9 * scale), (kind, axis)
    assert one["momentum_y"] == 0.0 and one["angular_momentum_x"] == 0.0 and one["angular_momentum_y"] != 0.0


def test_points_meet_a_mirror_as_a_layer():
    from matter.points import packing

    region = Cut(Slab("box", 1.0, -1.0, 0.0), (0, 1))
    points, volume = packing.graded(lambda x: np.full(len(x), 0.1), region, np.random.default_rng(2))
    assert volume.sum() == pytest.approx(1.0)
    assert (points[:, :2] > 0.024).all() and (points[:, :2] < 1.0).all()
    # half a spacing off: no gap, no crowd at the mirror
    near = np.count_nonzero(points[:, 0] < 0.2) / len(points)
    assert near == pytest.approx(0.2, abs=0.03)
    lowest = np.sort(points[:, 0])[:100]
    assert lowest.mean() == pytest.approx(0.05, abs=0.02)


@pytest.mark.parametrize(
    "of,more,said",
    [
        ("quarter", {"angle": 30.0}, "straight down"),
        ("half", {"target": ELLIPSOID}, "not its own mirror image"),
    ],
)
def test_what_is_not_its_own_mirror_image_is_refused(of, more, said):
    with pytest.raises(ValueError, match=said):
        settings(of, **more)


def test_periodic_sides_have_no_middle():
    box = Target(layers=(Layer(name="rock", material="basalt", thickness=30.0),), shape="block", width=60.0)
    with pytest.raises(ValueError, match="exclude each other"):
        settings("half", target=box, sides="periodic")
