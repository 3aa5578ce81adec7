"""Solid bodies: what a surface encloses, how far from it a point lies, how particles fill it, what is no surface."""

import itertools
import math
import time

import numpy as np
import pytest

from fixtures import solids
from matter.errors import InputError
from matter.geometry import tree
from matter.points import packing, regions
from matter.solids import distance, placed, solid

AXES = (177.0, 174.0, 116.0)
BODIES = {
    "ball": lambda: solids.ball(2.0),
    "ellipsoid": lambda: _ellipsoid(),
    "cube": lambda: solids.box((3.0, 3.0, 3.0)),
    "box": lambda: solids.box((1.0, 2.0, 4.0)),
    "dumbbell": lambda: solids.dumbbell(1.0, 2.4, 0.4),
    "ring": lambda: solids.ring(2.0, 0.7),
}


def _ellipsoid() -> solids.Known:
    made = solid.ellipsoid(AXES)
    volume, square = math.pi / 6.0 * math.prod(AXES), np.square(AXES)
    return solids.Known(
        made.vertices, made.triangles, volume, np.zeros(3), np.diag(volume * (square.sum() - square) / 20)
    )


def made(known: solids.Known) -> solid.Solid:
    return solid.checked(known.vertices, known.triangles, 1.0, "a body")


def filled(body: solid.Solid, count: int) -> tuple[np.ndarray, np.ndarray]:
    spacing = (body.volume / count) ** (1.0 / 3.0)
    inside = regions.Interior(body, distance.measured(body))
    return packing.graded(lambda x: np.full(len(x), spacing), inside, np.random.default_rng(1))


def inertia(points: np.ndarray, mass: np.ndarray) -> np.ndarray:
    moment = np.einsum("n,ni,nj->ij", mass, points, points)
    return np.trace(moment) * np.eye(3) - moment


@pytest.mark.parametrize("name", BODIES)
def test_a_surface_has_the_volume_centre_and_inertia_of_its_body(name):
    known = BODIES[name]()
    body = made(known)
    assert body.volume == pytest.approx(known.volume, rel=2e-3)
    shift = known.vertices.mean(axis=0) - body.vertices.mean(axis=0)  # the body is about its centre of mass
    assert np.abs(shift - known.centre).max() < 1e-3 * body.radius
    assert np.abs(body.inertia - known.inertia).max() < 3e-3 * np.trace(known.inertia)


def check_particles(name: str, count: int, limit: float) -> None:
    known = BODIES[name]()
    body = made(known)
    points, volume = filled(body, count)
    assert volume.sum() == pytest.approx(body.volume, rel=1e-12)
    centre = volume @ points / volume.sum()
    assert np.linalg.norm(centre) < limit * body.radius, centre / body.radius
    found = inertia(points - centre, volume)
    assert np.abs(found - body.inertia).max() < limit * np.trace(body.inertia), np.diag(found) / np.diag(body.inertia)
    assert (np.std(volume) / volume.mean()) < 0.1  # evenly spread, up to the surface


@pytest.mark.parametrize(
    "name", ["cube", *(pytest.param(name, marks=pytest.mark.validation) for name in ("ellipsoid", "dumbbell"))]
)
def test_particles_fill_a_body(name):
    check_particles(name, 3_000, 5e-3)


@pytest.mark.validation
@pytest.mark.parametrize("name", BODIES)
def test_a_hundred_thousand_particles_fill_a_body(name):
    check_particles(name, 100_000, 1e-3)


@pytest.mark.parametrize(
    "name", ["cube", *(pytest.param(name, marks=pytest.mark.validation) for name in ("dumbbell", "ring"))]
)
def test_depths_are_the_distance_to_the_nearest_triangle(name):
    body = made(BODIES[name]())
    grid = distance.measured(body, 48)
    rng = np.random.default_rng(3)
    corners = body.vertices[body.triangles]
    for index in np.stack([rng.integers(0, n, 40) for n in grid.depth.shape], axis=1):
        point = grid.low + index * grid.cell
        least = min(distance.squared_distance(*point, *triangle) for triangle in corners[_nearest(corners, point)])
        assert abs(grid.depth[tuple(index)]) == pytest.approx(math.sqrt(least), abs=0.1 * grid.cell)


def _nearest(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Triangles that may hold the nearest point: by a bound from their corners."""
    low = np.linalg.norm(corners.mean(axis=1) - point, axis=1)
    size = np.linalg.norm(corners - corners.mean(axis=1)[:, None], axis=2).max(axis=1)
    return np.flatnonzero(low - size <= (low + size).min())


@pytest.mark.validation
def test_beside_a_site_depths_are_exact_between_the_points_of_the_grid_too():
    """On a corner of a box, where the grid has eight cells for four metres; in a ball, where the grid is off by two
    thousandths of its radius."""
    box = made(solids.box((1.0, 2.0, 4.0)))
    corner = np.array([0.5, 1.0, 2.0])
    near = distance.measured(box, 8, site=corner)
    points = corner + np.random.default_rng(1).uniform(-0.28, 0.28, (2000, 3))
    over = points - corner
    outside = np.linalg.norm(np.maximum(over, 0.0), axis=1)
    wanted = np.where((over < 0.0).all(axis=1), -over.max(axis=1), -outside)
    depth, inwards = near.at(points)
    assert depth == pytest.approx(wanted, abs=1e-12)
    assert np.linalg.norm(inwards, axis=1) == pytest.approx(np.ones(len(points)), abs=1e-9)
    foot = points - depth[:, None] * inwards
    assert np.abs(np.abs(foot) - corner).min(axis=1) == pytest.approx(np.zeros(len(points)), abs=1e-9)

    ball = solid.ellipsoid((1000.0, 1000.0, 1000.0))
    site = ball.site(np.array([0.0, 0.0, 1.0]))[0]
    near = distance.measured(ball, site=site)
    points = site + np.random.default_rng(2).uniform(-0.5, 0.5, (500, 3)) * near.cell
    corners = ball.vertices[ball.triangles]
    depth = near.at(points)[0]
    for point, found in zip(points[:60], depth[:60]):
        least = min(distance.squared_distance(*point, *triangle) for triangle in corners[_nearest(corners, point)])
        assert abs(found) == pytest.approx(math.sqrt(least), rel=1e-9, abs=1e-9)
    truly = 500.0 - np.linalg.norm(points, axis=1)
    assert np.abs(depth - truly).max() < 0.02  # the triangles' own: some 8 m across
    assert near.at(site[None])[0][0] == pytest.approx(0.0, abs=1e-9)


def test_depths_of_one_body_are_made_once_for_all_stages(monkeypatch):
    """Each stage builds its own copy of the body; another body, and another grid, have depths of their own."""
    calls = []
    passed_on = distance._passed_on
    monkeypatch.setattr(distance, "_passed_on", lambda *a: calls.append(1) or passed_on(*a))
    distance._grid.cache_clear()
    first = distance.measured(solid.ellipsoid((3.0, 2.0, 1.0)), 20)
    again = distance.measured(solid.ellipsoid((3.0, 2.0, 1.0)), 20, site=np.array([0.0, 0.0, 0.5]))
    assert len(calls) == 1 and again.depth is first.depth and len(again.corners) > len(first.corners)
    other = distance.measured(solid.ellipsoid((3.0, 2.0, 1.1)), 20)
    finer = distance.measured(solid.ellipsoid((3.0, 2.0, 1.0)), 24)
    assert len(calls) == 3
    assert other.depth.max() > first.depth.max() and finer.depth.size > first.depth.size


@pytest.mark.parametrize("name", ["cube", "dumbbell", "ring"])
def test_the_side_on_which_a_point_lies_is_known_without_the_sweeps(name, monkeypatch):
    """Of 200,000 points about a body, and of 100,000 within two cells of its surface: the same as by the distances."""
    body, rng = made(BODIES[name]()), np.random.default_rng(4)
    whole = distance.measured(body, 48)
    points = rng.uniform(-1.1, 1.1, (200_000, 3)) * np.abs(body.vertices).max(axis=0)
    beside = body.vertices[rng.integers(0, len(body.vertices), 100_000)] + whole.cell * rng.uniform(
        -2, 2, (100_000, 3)
    )
    points = np.concatenate([points, beside])
    monkeypatch.setattr(distance, "_passed_on", None)
    np.testing.assert_array_equal(distance.sides(body, 48).at(points)[0] > 0.0, whole.at(points)[0] > 0.0)


def test_sweeps_find_what_they_find_when_every_neighbour_is_asked_every_time(monkeypatch):
    """Those that have not changed since they were asked are left out: the same triangles, to the last bit."""
    body, made_by = solids.dumbbell(0.8, 1.2, 0.5, rings=12, around=10), {}

    def plain(corners, low, cell, squared, nearest):
        made_by["beside"] = squared.copy(), nearest.copy()
        asked, triangles = made_by["beside"]
        for sweep in range(8):
            sides = [1 - 2 * (sweep >> axis & 1) for axis in range(3)]
            ways = [range(1, n) if side > 0 else range(n - 2, -1, -1) for n, side in zip(asked.shape, sides)]
            for index in itertools.product(*ways):
                for back in range(1, 8):
                    t = triangles[tuple(index[axis] - sides[axis] * (back >> axis & 1) for axis in range(3))]
                    if t >= 0 and t != triangles[index]:
                        d = distance.squared_distance(*(low + np.array(index) * cell), *corners[t])
                        if d < asked[index]:
                            asked[index], triangles[index] = d, t
        passed_on(corners, low, cell, squared, nearest)
        made_by["swept"] = squared.copy(), nearest.copy()

    passed_on = distance._passed_on
    monkeypatch.setattr(distance, "_passed_on", plain)
    distance._grid.cache_clear()
    distance.measured(made(body), 8)
    distance._grid.cache_clear()
    for plainly, swept in zip(made_by["beside"], made_by["swept"], strict=True):
        np.testing.assert_array_equal(swept, plainly)


def test_inside_is_inside():
    box = made(solids.box((1.0, 2.0, 4.0)))
    inside = regions.Interior(box, distance.measured(box))
    points = np.random.default_rng(0).uniform(-2.5, 2.5, (20_000, 3))
    wanted = (np.abs(points) < [0.5, 1.0, 2.0]).all(axis=1)
    clear = np.abs(np.abs(points) - [0.5, 1.0, 2.0]).min(axis=1) > 1e-6
    assert (inside.inside(points) == wanted)[clear].all()
    ring = made(BODIES["ring"]())
    assert not regions.Interior(ring, distance.measured(ring)).inside(np.zeros((1, 3)))[0]


def check_field(count: int, limit: float) -> None:
    """Pull on the particles of a dumbbell by the tree, with the softening of the shock stage (half a spacing), beside
    that of the polyhedron (Tsoulis 2012, Geophysics 77, F1): root mean square."""
    polyhedral = pytest.importorskip("polyhedral_gravity", reason="extra test: polyhedral-gravity")
    known = solids.dumbbell(80.0, 150.0, 40.0, rings=60, around=40)
    body = made(known)
    points, volume = filled(body, count)
    density = 2_400.0
    spacing = (body.volume / len(points)) ** (1.0 / 3.0)
    ours = tree.gravity(points, density * volume, np.full(len(points), 0.5 * spacing), 0.5)
    exact = polyhedral.Polyhedron(
        polyhedral_source=(body.vertices, body.triangles),
        density=density,
        normal_orientation=polyhedral.NormalOrientation.OUTWARDS,
        integrity_check=polyhedral.PolyhedronIntegrity.DISABLE,
    )
    some = np.random.default_rng(5).choice(len(points), 300, replace=False)
    theirs = np.array([field for _, field, _ in polyhedral.evaluate(exact, points[some])])
    theirs *= np.sign((theirs * ours[some]).sum())  # potential rises or falls outwards, by convention
    off = ((ours[some] - theirs) ** 2).sum(axis=1).mean() / (theirs**2).sum(axis=1).mean()
    assert math.sqrt(off) < limit


@pytest.mark.validation
def test_the_field_of_the_particles_is_that_of_the_polyhedron():
    check_field(6_000, 0.03)


@pytest.mark.validation
def test_the_field_of_a_hundred_thousand_particles_is_that_of_the_polyhedron():
    check_field(100_000, 0.01)


def test_an_open_surface_is_refused_with_the_place():
    known = solids.box((1.0, 1.0, 1.0))
    with pytest.raises(
        InputError, match=r"not watertight: 3 of 18 edges .* between \(0, 0, 0\) and .* ends the surface"
    ):
        solid.checked(known.vertices, known.triangles[1:], 1.0, "box.obj")
    twice = np.concatenate([known.triangles, known.triangles[:1]])
    with pytest.raises(InputError, match="belongs to 3 triangles"):
        solid.checked(known.vertices, twice, 1.0, "box.obj")


def test_normals_that_turn_both_ways_are_refused_and_inwards_ones_turned():
    known = solids.box((1.0, 1.0, 1.0))
    mixed = known.triangles.copy()
    mixed[0] = mixed[0, ::-1]
    with pytest.raises(InputError, match="turn different ways"):
        solid.checked(known.vertices, mixed, 1.0, "box.obj")
    assert solid.checked(known.vertices, known.triangles[:, ::-1], 1.0, "box.obj").volume == pytest.approx(1.0)


def test_a_surface_that_cuts_itself_is_refused():
    a, b = solids.box((1.0, 1.0, 1.0)), solids.box((1.0, 1.0, 1.0))
    both = np.concatenate([a.vertices, b.vertices + 0.5]), np.concatenate([a.triangles, b.triangles + 8])
    with pytest.raises(InputError, match="cuts itself"):
        distance.measured(solid.checked(*both, 1.0, "two"))


@pytest.mark.parametrize("suffix", solid.SUFFIXES)
def test_files_are_read_in_their_unit(tmp_path, suffix):
    import trimesh

    known = solids.dumbbell(0.08, 0.15, 0.04, rings=40, around=24)
    trimesh.Trimesh(known.vertices, known.triangles, process=False).export(tmp_path / f"body{suffix}")
    body = solid.read(tmp_path / f"body{suffix}", 1000.0)
    assert body.volume == pytest.approx(1e9 * made(known).volume, rel=1e-4)
    assert len(body.triangles) == len(known.triangles)


@pytest.mark.parametrize(
    "name,content,said",
    [
        ("a.obj", b"", "no surface of triangles|enclose nothing"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "enclose nothing"),
        (
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 nan\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 3 4\n",
            "not finite|no surface",
        ),
        ("a.stl", b"\xff" * 200, "no surface of triangles|enclose nothing"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1000000000\n", "no surface of triangles|enclose nothing"),
        ("a.glb", b"", "is read from .obj, .ply, .stl, not .glb"),
    ],
)
def test_what_is_no_surface_is_one_clear_line(tmp_path, name, content, said):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=said) as told:
        solid.read(tmp_path / name, 1.0)
    assert "\n" not in str(told.value)


CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def obj(path, number, blocks=2):
    """Tetrahedra of 1/6, each written with its faces behind it; ``number(block, corner)`` is what a face says."""
    text = ""
    for block in range(blocks):
        text += "".join("v {} {} {}\n".format(*(x + 10 * block for x in corner)) for corner in CORNERS)
        text += "".join("f " + " ".join(str(number(block, k)) for k in face) + "\n" for face in FACES)
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "number",
    [
        lambda block, k: 4 * block + k + 1,
        lambda block, k: k - 4,
        lambda block, k: f"{k - 4}/-1/1",
        lambda block, k: f"{4 * block + k + 1}//2",
    ],
)
def test_faces_are_counted_from_the_front_or_from_where_they_stand(tmp_path, number):
    body = solid.read(obj(tmp_path / "a.obj", number), 2.0)
    assert body.volume == pytest.approx(8.0 / 3.0, rel=1e-12) and len(body.triangles) == 8


def test_an_obj_may_hold_more_than_triangles(tmp_path):
    """Quads, a line that goes on, comments, normals and groups: the cube of 1 m."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    text = "# cube\no one\nvn 0 0 1\n" + "".join("v {} {} {} 0.5 0.5 0.5\n".format(*corner) for corner in corners)
    text += "g sides\n" + "".join("f {} {} \\\n  {} {}\n".format(*quad) for quad in quads)
    (tmp_path / "a.obj").write_text(text)
    body = solid.read(tmp_path / "a.obj", 1.0)
    assert body.volume == pytest.approx(1.0, rel=1e-12) and len(body.triangles) == 12


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("f 0 3 2", "line 5: 'f 0 3 2' is no face"),
        ("f -5 3 2", "line 5: 'f -5 3 2' is no face"),
        ("f 1 2", "line 5: 'f 1 2' is no face"),
        ("f 1 2 x", "line 5: 'f 1 2 x' is no face"),
        ("v 1 2", "line 5: 'v 1 2' is no vertex"),
        ("f 9 2 1", "a triangle names vertex 9 of 4"),
        ("v nan 0 0\nf 5 2 1", "vertex 5 is not finite"),
    ],
)
def test_a_line_that_is_no_vertex_or_face_is_named(tmp_path, line, said):
    text = obj(tmp_path / "a.obj", lambda block, k: k + 1, 1).read_text()
    (tmp_path / "a.obj").write_text(text.replace("f 1 3 2", line))
    with pytest.raises(InputError, match=said):
        solid.read(tmp_path / "a.obj", 1.0)


def test_triangles_without_an_extent_enclose_nothing(tmp_path):
    obj(tmp_path / "a.obj", lambda block, k: 1, 1)
    with pytest.raises(InputError, match="0 triangles with three corners enclose nothing"):
        solid.read(tmp_path / "a.obj", 1.0)


@pytest.mark.parametrize("far", [1.5, 50.0, 1e6, np.nan])
def test_a_vertex_that_no_triangle_names_is_none_of_the_body(far):
    ball = solids.ball(1.0)
    body = made(ball)
    more = solid.checked(np.vstack([[[far, 0.0, 0.0]], ball.vertices]), ball.triangles + 1, 1.0, "a body")
    assert (more.extent, more.volume) == (body.extent, body.volume)
    assert len(more.vertices) == len(body.vertices)
    # named by a triangle without an extent only
    flat = np.vstack([ball.triangles, [[len(ball.vertices)] * 3]])
    also = solid.checked(np.vstack([ball.vertices, [[50.0, 0.0, 0.0]]]), flat, 1.0, "a body")
    assert (also.extent, len(also.vertices)) == (body.extent, len(body.vertices))


@pytest.mark.parametrize("size", [1e-9, 1e-5, 1e9])
def test_a_body_is_the_same_at_any_size(size):
    """No tolerance in metres stands between."""
    box = solids.box((1.0, 2.0, 4.0))
    body = solid.checked(box.vertices + [1.0, 0.0, 0.0], box.triangles, size, "a body")
    assert body.volume / size**3 == pytest.approx(8.0, rel=1e-12)
    assert body.extent / size == pytest.approx(0.5 * math.sqrt(21.0), rel=1e-12)
    np.testing.assert_allclose(body.inertia / size**5, made(box).inertia, rtol=1e-9, atol=1e-12)


@pytest.mark.validation
def test_two_hundred_thousand_facets_in_less_than_a_minute():
    known = solids.ball(1.0, 4)
    distance.measured(made(known), 16)  # compiled
    known = solids.dumbbell(1.0, 2.4, 0.4, rings=400, around=256)
    assert len(known.triangles) > 200_000
    before = time.process_time()
    body = made(known)
    distance.measured(body)
    assert time.process_time() - before < 60.0


def test_the_site_is_where_latitude_and_longitude_say():
    latitude, longitude, azimuth = (math.radians(a) for a in (-8.84, 264.3, 30.0))
    body = placed.of_axes(AXES, latitude, longitude, azimuth)
    along = np.array(
        [math.cos(latitude) * math.cos(longitude), math.cos(latitude) * math.sin(longitude), math.sin(latitude)]
    )
    semi = 0.5 * np.asarray(AXES)
    assert body.height == pytest.approx(1.0 / np.linalg.norm(along / semi), rel=2e-4)
    assert body.turn @ along == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert body.turn @ body.turn.T == pytest.approx(np.eye(3), abs=1e-12)
    gradient = body.turn @ (along / semi**2)
    assert body.normal == pytest.approx(gradient / np.linalg.norm(gradient), abs=0.02)  # that of a facet
    north = body.turn @ (np.array([0.0, 0.0, 1.0]) - along[2] * along)
    assert math.atan2(north[1], north[0]) == pytest.approx(
        azimuth, abs=1e-12
    )  # +x is the flight, north lies to its left


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2])
def test_the_projectile_comes_at_its_angle_from_the_normal(angle):
    body = placed.of_axes(AXES, 0.6, 1.0, 0.4)
    velocity = np.array(body.velocity(6e3, angle))
    assert np.linalg.norm(velocity) == pytest.approx(6e3)
    assert -velocity @ body.normal / 6e3 == pytest.approx(math.cos(angle))
    level = velocity + 6e3 * math.cos(angle) * body.normal
    assert level[0] > 0.0 or angle == 0.0


def test_a_site_on_a_cubes_edge_and_one_behind_a_waist():
    cube = made(solids.box((2.0, 2.0, 2.0)))
    place, normal = cube.site(np.array([1.0, 1.0, 0.0]))
    assert place == pytest.approx([1.0, 1.0, 0.0]) and np.abs(normal).max() == pytest.approx(1.0)
    ring = made(BODIES["ring"]())
    place, normal = ring.site(np.array([1.0, 0.0, 0.0]))
    assert place[0] == pytest.approx(2.7, rel=1e-3) and normal[0] == pytest.approx(1.0, abs=1e-3)
    with pytest.raises(InputError, match="meets no surface"):
        ring.site(np.array([0.0, 0.0, 1.0]))
