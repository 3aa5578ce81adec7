"""The pair pass: exact symmetries, linear fields, rotation."""

import numpy as np
import pytest

from matter.geometry import neighbours
from sph.bodies.particle_cloud import Cloud
from sph.kernels import cubic_spline
from sph.kernels.dispatch import FAMILY as KERNELS
from sph.materials.rows import collect
from sph.pairs import rates, scheme, start_volumes
from sph.pairs import row as columns
from sph.stepping import state

SHEAR = np.array([2.8e9])


def rows_of(
    row: np.ndarray,
    extra: np.ndarray | None = None,
    start_density: np.ndarray | None = None,
    filled: np.ndarray | None = None,
) -> scheme.Rows:
    """``scheme.Rows`` with empty arrays for what is None, and full neighbourhoods."""
    return scheme.Rows(
        row,
        np.zeros((0, row.shape[1])) if extra is None else extra,
        np.zeros(0) if start_density is None else start_density,
        np.zeros((0, 6)),
        np.ones(len(row)) if filled is None else filled,
    )


class _Cloud:
    """The few arrays that the pair pass reads."""

    def __init__(self, n, seed=1):
        rng = np.random.default_rng(seed)
        side = round(n ** (1 / 3))
        grid = np.stack(np.meshgrid(*(np.arange(side),) * 3, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
        self.position = (grid + rng.uniform(-0.15, 0.15, grid.shape)) * 1e3
        h = 2e3 * rng.uniform(0.8, 1.3, len(grid))
        order, cells = neighbours.sort(self.position, h)
        self.position, self.support_radius = self.position[order], h[order]
        self.found = neighbours.build(self.position, self.support_radius, cells)
        m = len(order)
        self.density = 917.0 * rng.uniform(0.7, 1.3, m)
        self.mass = self.density * 1e9 * rng.uniform(0.8, 1.2, m)
        self.start_density = self.density * rng.uniform(0.5, 2.0, m)
        self.velocity = rng.normal(size=(m, 3)) * 100.0
        self.stress = rng.normal(size=(m, 5)) * 1e8
        self.pressure = rng.normal(size=m) * 1e9
        self.material = np.zeros(m, dtype=np.int32)

    def rows(self, stressed=True):
        s, P = self.stress * stressed, self.pressure
        made = np.zeros((len(P), columns.WIDTH))
        made[:, :3], made[:, columns.VX : columns.VZ + 1] = self.position, self.velocity
        made[:, columns.SUPPORT], made[:, columns.VOLUME] = self.support_radius, self.mass / self.density
        made[:, columns.RHO_INVERSE], made[:, columns.SOUND] = 1 / self.density, 3200.0
        made[:, columns.XX], made[:, columns.XY], made[:, columns.XZ] = s[:, 0] - P, s[:, 1], s[:, 2]
        made[:, columns.YY], made[:, columns.YZ], made[:, columns.ZZ] = s[:, 3] - P, s[:, 4], -s[:, 0] - s[:, 3] - P
        return made

    def evaluate(self, alpha=1.0, beta=2.0, stiffness=None, first=False, kernel="cubic_spline"):
        out, row = rates.Rates(len(self.mass), strain_rate=first), self.rows()
        if first:
            start_volumes.turn(row, self.start_density)
        chosen = scheme.Scheme(kernel=KERNELS.kind(kernel), reconstructed=first)
        self.summed(
            chosen,
            rows_of(row, np.zeros((len(row), chosen.extra_width)), self.start_density),
            out,
            rates.Damping(alpha, beta),
            stiffness,
        )
        return out

    def summed(self, chosen, rows, out, damping, stiffness=None):
        """Fill ``out`` by a scheme from its rows."""
        stiffness = np.ones((len(self.mass), 2)) if stiffness is None else stiffness
        rates.compute(
            chosen, rows, self.found, rates.Matter(self.material, SHEAR, stiffness, self.stress, True), damping, out
        )


def keeps_momentum_and_total_energy(c: _Cloud, r: rates.Rates) -> None:
    """Forces sum to nothing, and what they work is what the heat loses."""
    force = c.mass[:, None] * r.acceleration
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    work = (force * c.velocity).sum() + c.mass @ r.energy
    assert abs(work) < 1e-12 * np.abs(force * c.velocity).sum()


@pytest.mark.parametrize("first", [False, True])
def test_pairs_keep_momentum_and_total_energy(first):
    c = _Cloud(1000)
    keeps_momentum_and_total_energy(c, c.evaluate(first=first))


@pytest.mark.parametrize("longer", [1.0, 1.7])
def test_rates_are_those_of_the_formula(longer):
    """Directly summed, with some 60 and up to 269 partners."""
    c = _Cloud(1000)
    c.support_radius *= longer
    order, cells = neighbours.sort(c.position, c.support_radius)
    assert np.array_equal(order, np.arange(1000)) or longer > 1.0
    for name in ("position", "support_radius", "density", "mass", "velocity", "stress", "pressure"):
        setattr(c, name, getattr(c, name)[order])
    c.found = neighbours.build(c.position, c.support_radius, cells)
    assert (c.found.count.max() > 200) == (longer > 1.0)
    r, alpha, beta = c.evaluate(), 1.0, 2.0
    a, b, d, e, f = c.stress.T
    sigma = np.array([[a, b, d], [b, e, f], [d, f, -a - e]]).T - c.pressure[:, None, None] * np.eye(3)
    for i in (77, 431, int(np.argmax(c.found.count))):
        x, v, h = (
            c.position[i] - c.position,
            c.velocity[i] - c.velocity,
            0.5 * (c.support_radius[i] + c.support_radius),
        )
        q = np.linalg.norm(x, axis=1)
        vx, half = (v * x).sum(axis=1), 0.5 * h
        F = np.array([cubic_spline.gradient_factor(one, other) for one, other in zip(q, h)])
        mu = np.minimum(vx, 0.0) * half / (q * q + 0.01 * half * half)
        pressure = mu * (beta * mu - alpha * 3200.0) * 2.0 / (c.density[i] + c.density)
        V = c.mass / c.density
        force = np.einsum("jab,jb->ja", sigma[i] + sigma, x) * (V * F)[:, None] / c.density[i]
        wanted = (force - (c.mass * pressure * F)[:, None] * x).sum(axis=0)
        L = -np.einsum("j,ja,jb->ab", V * F, v, x)
        fraction = V[i] / (V[i] + V)
        heat = (sigma[i] * L).sum() / c.density[i] + (fraction * c.mass * pressure * F * vx).sum()
        assert r.acceleration[i] == pytest.approx(wanted, rel=1e-11, abs=1e-11 * np.abs(wanted).max())
        assert r.energy[i] == pytest.approx(heat, rel=1e-11, abs=1e-11 * np.abs(r.energy).max())
        shrinking = -c.density[i] * np.trace(L)
        assert r.density[i] == pytest.approx(shrinking, rel=1e-11, abs=1e-11 * np.abs(L).max() * 917.0)
        assert r.count[i] == np.count_nonzero(q < h) - 1
        near = -V * F * q * q
        assert r.mean_pressure[i] == pytest.approx(near @ c.pressure / near.sum(), rel=1e-11)


@pytest.mark.parametrize("first", [False, True])
def test_the_mean_pressure_of_even_pressure_is_that_pressure(first):
    """In matter compressed alike, whatever its density at rest, at surfaces too."""
    c = _Cloud(1000)
    c.pressure[:], c.density = 3e6, 1.2 * c.start_density
    assert c.evaluate(first=first).mean_pressure == pytest.approx(3e6, rel=1e-11)


def test_the_mean_pressure_counts_expanded_neighbours_little():
    """Over first volumes: a tenth of the density weighs a hundredth."""
    c = _Cloud(1000)
    c.density = np.where(c.position[:, 0] < c.position[:, 0].mean(), 0.1, 1.0) * c.start_density
    c.pressure[:] = np.where(c.density < 0.5 * c.start_density, 4e6, 2e6)
    mean = c.evaluate(first=True).mean_pressure
    r = np.linalg.norm(c.position[:, None] - c.position, axis=2)
    h = 0.5 * (c.support_radius[:, None] + c.support_radius)
    F = np.array([[cubic_spline.gradient_factor(a, b) for a, b in zip(*rows)] for rows in zip(r, h)])
    eta = c.density / c.start_density
    q = -(c.mass / c.start_density) * F * r * r * (eta / c.start_density) ** 2
    assert mean == pytest.approx(eta**2 * (q @ (c.pressure / eta**2)) / q.sum(axis=1), rel=1e-11)


def test_pressure_alone_keeps_angular_momentum():
    c = _Cloud(1000)
    c.stress[:] = 0
    r = c.evaluate()
    torque = c.mass[:, None] * np.cross(c.position, r.acceleration)
    assert np.abs(torque.sum(axis=0)).max() < 1e-11 * np.abs(torque).sum()


def test_neighbours_are_counted():
    c = _Cloud(1000)
    r = c.evaluate()
    i = 431
    d = np.linalg.norm(c.position - c.position[i], axis=1)
    assert r.count[i] == np.count_nonzero(d < 0.5 * (c.support_radius + c.support_radius[i])) - 1


@pytest.mark.parametrize("options", [{}, {"first": True}, {"kernel": "wendland"}], ids=["usual", "first", "wendland"])
def test_stress_rate_of_a_linear_flow_is_exact(options):
    """Corrected gradients: dS = 2 mu dev(eps) exactly for v = L x, in disorder and for unequal h."""
    c = _Cloud(1000)
    L = np.array([[1.0, 0.4, -0.3], [0.2, -0.5, 0.7], [0.1, 0.6, 0.3]]) * 1e-3
    c.velocity = c.position @ L.T
    c.stress[:] = 0
    r = c.evaluate(0.0, 0.0, **options)
    eps = 0.5 * (L + L.T)
    eps -= np.eye(3) * np.trace(eps) / 3
    wanted = 2 * SHEAR[0] * np.array([eps[0, 0], eps[0, 1], eps[0, 2], eps[1, 1], eps[1, 2]])
    inner = ((c.position > 2.5e3) & (c.position < 6.5e3)).all(axis=1)
    assert np.abs(r.stress[inner] - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_density_over_first_volumes_is_a_function_of_the_places():
    """rho_i / rho_0i changes by what sum_j V0_j W_ij changes by, whatever the density is."""
    c = _Cloud(1000)
    r = c.evaluate(0.0, 0.0, first=True)
    first, dt = c.mass / c.start_density, 1e-3

    def spread(position, i):
        d = np.linalg.norm(position - position[i], axis=1)
        return sum(
            first[j] * cubic_spline.kernel(d[j], 0.5 * (c.support_radius[i] + c.support_radius[j]))
            for j in np.flatnonzero(d < 3e3)
        )

    for i in (77, 431, 900):
        change = spread(c.position + dt * c.velocity, i) - spread(c.position - dt * c.velocity, i)
        assert r.density[i] == pytest.approx(c.start_density[i] * change / (2.0 * dt), rel=1e-5)
        assert r.density[i] == pytest.approx(-c.density[i] * r.divergence[i], rel=1e-12)


def test_at_the_start_both_volumes_are_one():
    c = _Cloud(1000)
    c.start_density[:] = c.density
    present, start = c.evaluate(), c.evaluate(first=True)
    for name in ("acceleration", "density", "energy", "stress", "divergence"):
        one, other = getattr(present, name), getattr(start, name)
        assert np.abs(one - other).max() < 1e-12 * np.abs(one).max(), name


def test_rotation_turns_the_stress_and_makes_none():
    """Jaumann: for rigid rotation dS/dt = W S - S W, so that invariants stay."""
    c = _Cloud(1000)
    w = np.array([0.3, -0.2, 0.5]) * 1e-3
    c.velocity = np.cross(w, c.position)
    W = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    r = c.evaluate(0.0, 0.0)
    inner = np.flatnonzero(((c.position > 2.5e3) & (c.position < 6.5e3)).all(axis=1))
    for i in inner:
        a, b, cc, d, e = c.stress[i]
        S = np.array([[a, b, cc], [b, d, e], [cc, e, -a - d]])
        wanted = W @ S - S @ W
        got = np.array([r.stress[i, 0], r.stress[i, 1], r.stress[i, 2], r.stress[i, 3], r.stress[i, 4]])
        assert got == pytest.approx(
            np.array([wanted[0, 0], wanted[0, 1], wanted[0, 2], wanted[1, 1], wanted[1, 2]]), rel=1e-8, abs=1e-3
        )


def test_pores_scale_the_strain_of_the_matrix_and_neither_rotation_nor_energy():
    """Porous: dS = 2 f mu dev(eps) + rotation, f by the sign of the divergence; force and heating do not see f."""
    c = _Cloud(1000)
    solid = c.evaluate()
    f = np.stack([np.full(1000, 0.25), np.full(1000, 0.5)], axis=1)
    porous, none = c.evaluate(stiffness=f), c.evaluate(stiffness=0.0 * f)
    assert np.array_equal(solid.acceleration, porous.acceleration) and np.array_equal(solid.energy, porous.energy)
    share = np.where(solid.divergence < 0, 0.25, 0.5)[:, None]
    assert (
        np.abs(porous.stress - none.stress - share * (solid.stress - none.stress)).max()
        < 1e-9 * np.abs(solid.stress).max()
    )
    c.velocity = np.cross([0.3e-3, -0.2e-3, 0.5e-3], c.position)
    inner = ((c.position > 2.5e3) & (c.position < 6.5e3)).all(axis=1)
    turned, held = c.evaluate(0.0, 0.0).stress[inner], c.evaluate(0.0, 0.0, 0.0 * f).stress[inner]
    assert np.abs(turned - held).max() < 1e-9 * np.abs(turned).max() and np.abs(held).max() > 1e4


def test_damage_takes_tension_and_shear_once():
    """A broken particle carries no tension and no shear; its pressure in compression is whole."""
    materials = collect(("ice",))

    n = 4
    cloud = Cloud(n)
    cloud.mass = np.full(n, 1e16)
    cloud.density = np.array([900.0, 900.0, 930.0, 930.0])
    cloud.support_radius = np.full(n, 1e5)
    cloud.stress = np.full((n, 5), 1e6)
    cloud.root_damage, cloud.distention, cloud.initial_distention = (
        np.array([0.0, 1.0, 0.0, 1.0]),
        np.ones(n),
        np.ones(n),
    )
    cloud.material, cloud.neighbours = np.zeros(n, dtype=np.int32), np.full(n, 33, dtype=np.int32)
    cloud.flaw_first[:], cloud.flaw_last[:] = np.arange(n), np.arange(1, n + 1)  # other types are another kernel
    cloud.flaw_strain = np.full(n, 1.0, dtype=np.float32)
    out = state.Evaluated(n)
    state.evaluate(cloud, materials.rows, True, True, out)
    assert out.pressure[0] == -materials.rows.tension[0]  # the cut
    assert out.pressure[1] == 0.0
    assert out.pressure[2] == out.pressure[3] > 0.0
    assert out.row[1, 11] == 0.0 and out.row[3, 11] == 0.0
    assert out.row[2, 11] == pytest.approx(1e6)


def test_a_particle_without_neighbours_feels_no_pressure():
    assert (
        state.interaction_fraction(0) == 0.0
        and state.interaction_fraction(state.FREE) == 0.0
        and state.interaction_fraction(state.BOUND) == 1.0
    )
