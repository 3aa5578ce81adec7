"""Simple shear of a periodic cell at constant normal stress (``dem.trials.shear_cell``), slow against the grains' own
motion: inertial number I = (dgamma/dt) d sqrt(rho / P) = 0.002, without friction 0.0005 (there the excess falls with
sqrt(I) only). The steady state has forgotten how the grains were packed. (GDR MiDi 2004, Eur. Phys. J. E 14, 341.)

At a larger ``inertial`` number the same grains resist more and lie looser: the friction of a flow whose shear is fast
against the time d sqrt(rho / P) in which its weight moves a grain by its size. Springs are then as stiff as keeps the
overlaps of meeting grains at 0.02 d, k_n = 1300 I^2 P d.
"""

from __future__ import annotations

import math

import numpy as np

from dem.contact.settings import Contact
from dem.trials.shear_cell import CELL_STIFFNESS, Cell
from matter.progress import Progress, stop_here

SLOW, SLOW_SMOOTH = 2e-3, 5e-4
BLOCK = 0.1
"""Strain of one block of the mean; its error comes from the scatter of the blocks, taken singly and in twos and
fours."""
LEAST_TIME = 5.0
"""Of a block, in d sqrt(rho / P): fast shear outruns what the grains remember."""
FAST = 1300.0
"""k_n over I^2 P d where the shear is fast."""
WANTED_ERROR = 0.35
"""Degrees: a measurement goes on until its standard error is below this, between the smallest and the largest
strain."""
LEAST, MOST = 2.0, 6.0  # of slow shear; of faster one as many blocks


def sample(count: int, seed: int, spread: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Grains on a loose cubic lattice with a little disorder, their radii, and the lattice's side."""
    rng = np.random.default_rng(seed)
    radius = 0.5 * rng.uniform(1.0 - spread, 1.0 + spread, count)
    side = math.ceil(count ** (1.0 / 3.0))
    spacing = 2.0 * radius.max() + 0.02
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[
        rng.permutation(side**3)[:count]
    ]
    return spacing * lattice + rng.uniform(-0.01, 0.01, (count, 3)), radius, side


def shear(
    contact: Contact,
    seed: int = 1,
    count: int = 1000,
    spread: float = 0.15,
    inertial: float | None = None,
    stiffness: float = CELL_STIFFNESS,
) -> dict[str, float]:
    """Steady simple shear: both angles and their errors (``error_deg``, ``mohr_coulomb_error_deg``), ``fraction``,
    ``coordination``, ``strain``, ``inertial``, by default that of the slow state, and ``kinetic_pressure``,
    the fraction of P that the grains' own motion bears. ``stiffness``: k_n of a grain of mean size over P d."""
    x, radius, side = sample(count, seed, spread)
    length = (2.0 * radius.max() + 0.02) * side
    slow = inertial or (SLOW_SMOOTH if contact.shell.friction == 0.0 else SLOW)
    cell = Cell(x, radius, np.array([length, length, 1.2 * length]), contact, max(stiffness, FAST * slow * slow))
    cell.pressure = 1.0
    # the loose lattice is pressed together while it is sheared quickly, then brought to the wanted state
    block = max(BLOCK, LEAST_TIME * slow)
    last = ((5.0 * slow, 0.2), (slow, 0.2)) if slow < 0.02 else ((slow, 10.0 * block),)
    for rate, strain in ((0.05, 1.0), (0.02, 0.6), *last):
        cell.rate = rate
        cell.run(max(1, int(strain / rate / cell.dt)))
    steps = max(1, int(block / slow / cell.dt))
    rows: list[list[float]] = []
    progress = Progress("friction angle", MOST)
    while True:
        mean = cell.run(steps)
        tau, normal = -mean["xz"], mean["zz"]
        half, middle = 0.5 * (mean["xx"] - normal), 0.5 * (mean["xx"] + normal)
        thermal = 2.0 / 3.0 * mean["fluctuation"] * count / (cell.period[0] * cell.period[1] * mean["height"])
        rows.append([tau / normal, math.hypot(half, tau) / middle, mean["fraction"], mean["coordination"], thermal])
        strain = block * len(rows)
        table = np.array(rows)
        error = math.degrees(_error(table[:, 0]) / (1.0 + table[:, 0].mean() ** 2))
        sine_error = math.degrees(_error(table[:, 1]) / math.sqrt(max(1.0 - table[:, 1].mean() ** 2, 1e-12)))
        progress.update(len(rows) * BLOCK, f"{math.degrees(math.atan(table[:, 0].mean())):.2f} +- {error:.2f} deg")
        stop_here("friction angle")
        done = BLOCK * len(rows)
        if done >= MOST or (done >= LEAST and error < WANTED_ERROR):
            break
    mu, sine, fraction, coordination, thermal = table.mean(axis=0)
    return {
        "angle_deg": math.degrees(math.atan(mu)), "error_deg": error,
        "mohr_coulomb_deg": math.degrees(math.asin(min(1.0, sine))),
        "mohr_coulomb_error_deg": sine_error, "fraction": float(fraction), "coordination": float(coordination),
        "strain": strain, "inertial": slow, "kinetic_pressure": float(thermal),
    }  # fmt: skip


def _error(values: np.ndarray) -> float:
    """Standard error of the mean of correlated values: the largest over blocks of one, two and four."""
    errors = []
    for size in (1, 2, 4):
        whole = len(values) // size
        if whole >= 4:
            means = values[: whole * size].reshape(whole, size).mean(axis=1)
            errors.append(float(means.std(ddof=1)) / math.sqrt(whole))
    return max(errors, default=math.inf)
