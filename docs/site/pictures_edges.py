"""Pictures of kernels and of the edges of flat ground."""

from __future__ import annotations

import itertools
import math
from types import ModuleType
from typing import Any

import numpy as np

from sph.boundary import fixed, periodic, quiet, wall
from sph.boundary.images import Images
from sph.kernels import cubic_spline, dispatch

SUPPORT_OF_ONE = 2.0
"""Support radius of the drawn lattices, in spacings."""


def kernel(law: ModuleType, axes: Any) -> str:
    """W and its slope, and the spectrum."""
    r = np.linspace(0.0, 1.1, 300)
    axes[0].plot(r, [law.kernel(x, 1.0) for x in r], "k", label="W")
    axes[0].plot(r, [x * law.gradient_factor(x, 1.0) for x in r], "C1", label="dW/dr")
    axes[0].set(xlabel="r / h", ylabel="W h$^3$, dW/dr h$^4$")
    axes[0].legend()
    k = np.linspace(0.05, 40.0, 300)
    q = np.linspace(0.0, 1.0, 2001)
    for module in sorted(dispatch.FAMILY.laws, key=lambda one: one is law):
        W = np.array([module.kernel(x, 1.0) for x in q])
        wave = np.array([np.trapezoid(4 * np.pi * q**2 * W * np.sinc(one * q / np.pi), q) for one in k])
        own = module is law
        axes[1].semilogy(k, np.abs(wave), "k" if own else "0.7", lw=1.5 if own else 1.0)
        axes[1].plot(k[wave < 0], np.abs(wave[wave < 0]), ".", color="C3" if own else "0.8", ms=2)
    axes[1].set(xlabel="wave number k h", ylabel="spectrum of W", ylim=(1e-6, 1.5))
    return (
        "Left: the kernel and its slope, in units of the support radius h. Right: its spectrum (grey: the other "
        "kernel); where it is negative (red) particles may pair up."
    )


def _lattice(wide: int, deep: int) -> np.ndarray:
    """Places (n, 2) [spacings] of a square section of ground, its floor at 0."""
    return np.array(list(itertools.product(np.arange(wide) + 0.5, np.arange(deep) + 0.5)))


def _sum(position: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The kernel sum (n,) of unit volumes at ``others`` about each ``position``, in a lattice that goes on along y."""
    total = np.zeros(len(position))
    for y in range(-2, 3):
        gap = np.sqrt(((position[:, None] - others[None]) ** 2).sum(axis=-1) + y * y)
        total += np.array([[cubic_spline.kernel(g, SUPPORT_OF_ONE) for g in row] for row in gap]).sum(axis=1)
    return total


def edge(law: ModuleType, axes: Any) -> str:
    """Ground with this boundary below and at its sides, and what the kernel sums miss of it."""
    ground = _lattice(12, 8)
    place3 = np.column_stack([ground[:, 0], np.zeros(len(ground)), ground[:, 1]])
    reach = np.full(len(ground), SUPPORT_OF_ONE)
    images = np.zeros((0, 3))
    still = np.zeros(len(ground), bool)
    if law is wall:
        images = Images((*wall.planes(0, 0.0, 12.0), *wall.planes(2, 0.0))).image_positions(place3, reach)
    elif law is periodic:
        images = Images(periodic.planes(0, 0.0, 12.0)).image_positions(place3, reach)
    elif law is fixed:
        far = np.minimum.reduce([ground[:, 0], 12.0 - ground[:, 0], ground[:, 1]])
        still = fixed.rim(far, reach)
    axes[0].plot(*ground[~still].T, "C0o", ms=4, label="ground")
    if still.any():
        axes[0].plot(*ground[still].T, "ko", ms=4, label="rim that never moves")
    if len(images):
        axes[0].plot(images[:, 0], images[:, 2], "o", mfc="none", mec="C1", ms=4, label="images")
    axes[0].set(xlabel="x [spacings]", ylabel="z [spacings]", aspect="equal")
    axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, 1.25), ncols=2)
    middle = (ground[:, 1] > 3) & (ground[:, 1] < 5) & ~still
    seen = np.concatenate([ground, images[:, [0, 2]]])
    alone, with_it = _sum(ground[middle], ground[~still]), _sum(ground[middle], seen)
    order = np.argsort(ground[middle, 0], kind="stable")
    x = ground[middle, 0][order]
    axes[1].plot(x, alone[order], color="0.7", label="nothing beyond the sides")
    axes[1].plot(x, with_it[order], "k.", label="with the boundary")
    axes[1].set(xlabel="x [spacings]", ylabel="kernel sum", ylim=(0, 1.15), xlim=(0, 12))
    axes[1].legend(loc="lower center")
    return (
        "Left: a section through ground with this boundary. Right: the sum of the kernel over all that a particle at "
        "half depth sees, 1 where nothing is missing, from side to side."
    )


def images(law: ModuleType, axes: Any) -> str:
    """A corner of two walls, and a moving wall's images."""
    ground = _lattice(6, 6)
    position = np.column_stack([ground[:, 0], np.zeros(len(ground)), ground[:, 1]])
    seen = Images((*wall.planes(0, 0.0), *wall.planes(2, 0.0)))
    beyond = seen.image_positions(position, np.full(len(position), 4.0))
    axes[0].plot(*ground.T, "C0o", ms=4)
    corner = (seen.sign[:, 0] < 0) & (seen.sign[:, 2] < 0)
    axes[0].plot(*beyond[~corner][:, [0, 2]].T, "o", mfc="none", mec="C1", ms=4, label="of one plane")
    axes[0].plot(*beyond[corner][:, [0, 2]].T, "s", mfc="none", mec="C3", ms=4, label="of both")
    axes[0].axvline(0, color="k", lw=0.8)
    axes[0].axhline(0, color="k", lw=0.8)
    axes[0].set(xlabel="x [spacings]", ylabel="z [spacings]", aspect="equal")
    axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, 1.22), ncols=2)
    column = np.column_stack([np.zeros((8, 2)), np.arange(8) + 0.5])
    piston = Images((wall.Wall(2, 0.0, 0.3),))
    for time in (0.0, 1.0):
        beyond = piston.image_positions(column, np.full(8, 4.0)) if time == 0.0 else beyond + piston.drift * time
        axes[1].plot(np.full(len(column), time), column[:, 2], "C0o", ms=4)
        axes[1].plot(np.full(len(beyond), time), beyond[:, 2], "o", mfc="none", mec="C1", ms=4)
        axes[1].plot([time - 0.2, time + 0.2], [0.3 * time] * 2, "k", lw=2)
    axes[1].set(xlabel="time [s]", ylabel="z [spacings]", xlim=(-0.5, 1.5), xticks=[0, 1])
    return (
        "Left: particles in a corner of two walls and the images that complete their neighbourhoods; those of both "
        "planes fill the corner. Right: the images before a wall that moves at 0.3 spacings per second drift at twice "
        "its speed."
    )


def layer(law: ModuleType, axes: Any) -> str:
    """The coefficient of the quiet layer, and what it leaves of a wave."""
    inside = np.linspace(0.0, 1.6, 400)
    kappa = quiet.coefficient(inside, 1.0)
    axes[0].plot(inside, kappa, "k")
    axes[0].set(xlabel="distance from the rim / D", ylabel="kappa D")
    step = inside[1] - inside[0]
    inward = np.exp(-np.cumsum(kappa[::-1]) * step)
    outward = inward[-1] * np.exp(-np.cumsum(kappa) * step)
    axes[1].semilogy(inside[::-1], inward, "C0", label="on its way in")
    axes[1].semilogy(inside, outward, "C1", label="on its way out")
    axes[1].axhline(math.exp(-2.0 * quiet.ATTENUATION), color="0.6", ls=":")
    axes[1].set(xlabel="distance from the rim / D", ylabel="amplitude of a wave")
    axes[1].legend()
    return (
        f"Left: how strongly the layer of width D fades what is in it. Right: a wave that runs in, turns at the rim "
        f"({inward[-1]:.3f} is left there) and comes back with {outward[-1]:.4f} of its height (dotted: exp(-2 A))."
    )


DRAWN = {
    "sph/kernels/": kernel,
    "sph/boundary/": edge,
    "sph/boundary/images": images,
    "sph/boundary/quiet": layer,
}
