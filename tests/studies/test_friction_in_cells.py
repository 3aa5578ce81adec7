"""Friction in the grid code: exact fronts, a flow that shells know, its energy; and the shock stage beside it."""

import numpy as np
import pytest
from scipy.optimize import brentq

from fixtures import porous_source
from sph.eos import dispatch as eos
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.strength import dispatch as strengths
from studies.eulerian import godunov, porous_ball
from studies.eulerian.flow import Flow

NAME = "crushed by strain"


@pytest.mark.parametrize("speed", [300.0, 1000.0])
def test_plates_with_friction_meet_at_the_exact_stress(speed):
    """Solid rock that strikes rock at rest: P + 2 Y / 3 = rho_0 U v, u = v^2 / 2 behind the front; pressure within
    5e-3, the deviator along the front at its limit, half of it across."""
    rock = Choice(strength="drucker_prager", predamaged=True, tension={"cut": "0 Pa"},
                  drucker_prager={"friction_angle": "20 deg", "cohesion": "0 Pa"})  # fmt: skip
    materials, n = collect(("granite",), {"granite": rock}), 150
    rows, rho0 = materials.rows, float(materials.rows.rho0[0])

    def behind(rho):
        P = eos.pressure_and_derivatives(int(rows.eos[0]), rows.eos_row[0], rho, 0.5 * speed**2)[0]
        return P, strengths.yield_stress(int(rows.strength[0]), rows.strength_row[0], P, 0.5 * speed**2, 1.0)

    def missing(rho):
        P, Y = behind(rho)
        return P + 2.0 / 3.0 * Y - rho0 * rho * speed**2 / (rho - rho0)

    rho = brentq(missing, 1.001 * rho0, 3.0 * rho0)
    P, Y = behind(rho)
    conserved = np.zeros((4, 2 * n, 8))
    conserved[:, :, godunov.MASS] = conserved[:, :, godunov.DISTENDED] = rho0
    conserved[:, :n, godunov.ALONG_Z] = 2.0 * rho0 * speed
    conserved[:, :n, godunov.ENERGY] = 2.0 * rho0 * speed**2
    ends = (godunov.REFLECTING, godunov.REFLECTING), (godunov.OPEN, godunov.OPEN)
    flow = Flow(conserved, 1.0, -float(n), materials, ends=ends)
    time = 60.0 * (rho - rho0) / (rho0 * speed)
    flow.run(time)
    beyond = slice(n + round(speed * time) + 15, n + round(speed * time) + 40)
    plateau = flow.state[0, beyond]
    rr, zz, _ = (conserved[0, beyond, godunov.SHEARED :] / plateau[:, godunov.RHO, None]).mean(axis=0)
    assert plateau[:, godunov.P].mean() == pytest.approx(P, rel=5e-3)
    assert plateau[:, godunov.U].mean() == pytest.approx(0.5 * speed**2, rel=0.01)
    assert zz == pytest.approx(-2.0 / 3.0 * Y, rel=5e-3)
    assert rr == pytest.approx(Y / 3.0, rel=5e-3)


def source(materials, cells: int, friction: bool = True, reach: float = 4.0) -> Flow:
    """The ball of ``fixtures.porous_source`` about the origin, which flies apart."""
    h, n = porous_source.RADIUS / cells, round(reach * cells)
    r, z = (np.arange(n) + 0.5) * h, (np.arange(-n, n) + 0.5) * h
    away = np.hypot(r[:, None], z)
    rho0, v = float(materials.bulk_density[0]), porous_source.start_speed(away / porous_source.RADIUS)
    conserved = np.zeros((n, 2 * n, 8 if friction else 5))
    conserved[:, :, godunov.MASS], conserved[:, :, godunov.DISTENDED] = rho0, rho0 * materials.rows.alpha0[0]
    conserved[:, :, godunov.ACROSS_R] = rho0 * v * r[:, None] / away
    conserved[:, :, godunov.ALONG_Z] = rho0 * v * z / away
    conserved[:, :, godunov.ENERGY] = 0.5 * rho0 * v**2
    angles = np.radians([10.0, 45.0, 80.0])
    markers = [[x * np.sin(a), x * np.cos(a)] for x in porous_source.TRACERS for a in angles]
    return Flow(conserved, h, -n * h, materials, porous_source.RADIUS * np.array(markers))


def kinetic(flow: Flow) -> float:
    rho = np.maximum(flow.conserved[:, :, godunov.MASS], 1e-9)
    square = (flow.conserved[:, :, [godunov.ACROSS_R, godunov.ALONG_Z]] ** 2).sum(axis=2) / rho
    return float((flow.lines[0][1][:, None] * square).sum())


def test_a_source_in_ground_with_friction_goes_on_as_in_shells():
    """Kinetic energy at 4.4 ms 0.84 of that of the shells with 12 cells to the radius (0.79 with 6, 0.98 with the
    friction left out in both); radii of markers within 5 %, alike to 2 % whatever their direction; energy kept."""
    materials = porous_source.ground(NAME)
    (exact,) = porous_source.in_shells(materials, [4.4e-3])
    left, radii = [], []
    for cells in (6, 12):
        flow = source(materials, cells)
        begun, energy = kinetic(flow), flow.totals()[2]
        flow.run(4.4e-3)
        left.append(kinetic(flow) / begun / exact.kinetic)
        radii = np.hypot(*flow.position.T).reshape(len(porous_source.TRACERS), -1) / porous_source.RADIUS
        assert flow.totals()[2] == pytest.approx(energy, rel=1e-6)
    assert 0.75 < left[0] < left[1] < 1.0 and left[1] > 0.83
    assert radii.mean(axis=1) == pytest.approx(exact.radii, rel=0.05)
    assert (radii.std(axis=1) < 0.02 * radii.mean(axis=1)).all()
    free = source(materials, 12, friction=False)
    begun = kinetic(free)
    free.run(4.4e-3)
    assert kinetic(free) / begun / exact.kinetic > 1.2


@pytest.mark.xfail(strict=True, reason="friction acts late in fronts as thick as the ball: 1.8 times the momentum")
def test_a_ball_of_two_spacings_gives_ground_with_friction_the_momentum_that_it_should():
    """Outwards at 10 ms 1.13 for 0.63 of the ball's; with 2.63, 5.26, 10.5 spacings to the radius 1.04, 0.89, 0.76."""
    (cells,) = porous_ball.in_cells(NAME, [10e-3], 10, friction=True)
    (particles,) = porous_ball.in_particles(NAME, [10e-3], 2.0, friction=True)
    assert cells.outwards == pytest.approx(0.63, rel=0.05)
    assert particles.outwards == pytest.approx(cells.outwards, rel=0.09)
