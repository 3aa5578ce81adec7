"""Porous ground in the grid code: exact fronts; and the shock stage beside it."""

import numpy as np
import pytest

from fixtures.porous_source import GROUNDS
from sph.shock_states import compaction_wave
from studies.eulerian import godunov, porous_ball
from studies.eulerian.flow import Flow

ENDS = (godunov.REFLECTING, godunov.REFLECTING), (godunov.OPEN, godunov.OPEN)


@pytest.mark.parametrize("name", GROUNDS)
@pytest.mark.parametrize("speed", [300.0, 1000.0])
def test_plates_of_porous_ground_meet_at_the_exact_pressure(name, speed):
    """Pressure within 2e-3, density within 1e-3, no pores left that the front should close."""
    materials, n = porous_ball.ground(name), 150
    waves = compaction_wave.driven(materials.rows, 0, speed)
    rho0, alpha0 = float(materials.bulk_density[0]), float(materials.rows.alpha0[0])
    conserved = np.zeros((3, 2 * n, 5))
    conserved[:, :, godunov.MASS], conserved[:, :, godunov.DISTENDED] = rho0, rho0 * alpha0
    conserved[:, :, godunov.ALONG_Z] = rho0 * speed * np.repeat([1.0, -1.0], n)
    conserved[:, :, godunov.ENERGY] = 0.5 * rho0 * speed**2
    flow = Flow(conserved, 1.0, -float(n), materials, ends=ENDS)
    flow.run(60.0 / (waves.front.shock_speed - speed))
    plateau = flow.state[0, n + 15 : n + 40]
    assert plateau[:, godunov.P].mean() == pytest.approx(waves.front.P, rel=2e-3)
    assert plateau[:, godunov.RHO].mean() == pytest.approx(waves.front.rho, rel=1e-3)
    assert plateau[:, godunov.ALPHA].mean() == pytest.approx(waves.distention, rel=1e-3)


@pytest.mark.parametrize("name", GROUNDS)
def test_a_ball_of_two_spacings_gives_the_ground_the_momentum_that_it_should(name):
    """With pairs of ball and ground as any other 1.24 (by strain) and 1.18 of the momentum outwards at 10 ms, and 1.08
    and 1.09 at 20 ms."""
    early, late = porous_ball.in_cells(name, [10e-3, 20e-3], 10)
    soon, then = porous_ball.in_particles(name, [10e-3, 20e-3], 2.0)
    assert soon.outwards == pytest.approx(early.outwards, rel=0.09)
    assert then.outwards == pytest.approx(late.outwards, rel=0.05)
