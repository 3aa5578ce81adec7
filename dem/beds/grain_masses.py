"""Masses of the grains of a bed: such that its layers have their densities whatever the packing, and its weight is
level."""

from __future__ import annotations

import numpy as np
from scipy.optimize import isotonic_regression

from dem.beds import bed_measures, grain_packing
from dem.beds.layered_body import LayeredBody
from dem.contact.settings import SPECIES, Contact
from dem.grains.assembly import Assembly
from matter.geometry.ground_region import Cone
from matter.particles import Particles

LEVEL_GAIN = 2.0
"""Correction per round of ``rest`` over the estimate in ``levelled``: the solid layer bridges part of it, so the
estimate is too small."""


def matched(grains: Particles, bed: Assembly | None, body: LayeredBody, domain: Cone, contact: Contact) -> Particles:
    """The grains with material, species, mass and stiffness for where they are; ``bed`` None takes a nominal
    packing fraction.

    The mass of a grain is rho(r) V / phi(r), phi measured in windows of 5 radii; in a liquid it is made never to
    grow outwards (isotonic regression): a frictionless ocean of grains that are lighter below than above turns
    over. At last the whole is scaled to the body's mass between floor and datum.
    """
    distance = np.linalg.norm(grains.position, axis=1)
    rho = body.density(distance)
    volume = 4.0 / 3.0 * np.pi * grains.radius**3
    mean = float(grains.radius.mean())
    if bed is None:
        mass = rho * volume / grain_packing.FRACTION
    else:
        top = min(domain.datum + 3.0 * mean, float(np.percentile(distance, 99.0)))
        shells = bed_measures.Shells(grains.position, grains.radius, domain, 0.25 * mean, top)
        phi = shells.smooth(np.asarray(shells.grain_volume.sum(axis=0)).ravel(), 5.0 * mean)
        grain_density = rho / np.interp(distance, shells.middle, phi)
        liquid = np.flatnonzero(
            [contact.species_of(body.materials[k]) == SPECIES.index("ocean") for k in body.layer_of(distance)]
        )
        if len(liquid):
            outwards = liquid[np.argsort(distance[liquid], kind="stable")]
            fit = isotonic_regression(grain_density[outwards], weights=volume[outwards], increasing=False)
            grain_density[outwards] = fit.x
        mass = grain_density * volume
        below = distance <= domain.datum
        mass *= body.mass_between(domain.floor, domain.datum, domain.solid_angle) / mass[below].sum()
    layer = body.layer_of(distance)
    names = list(dict.fromkeys(body.materials))
    material, species, stiffness = (np.empty(len(grains)) for _ in range(3))
    floor = float(body.pressure(np.array(domain.floor)))
    for k, name in enumerate(body.materials):
        here = layer == k
        material[here], species[here] = names.index(name), contact.species_of(name)
        stiffness[here] = contact.stiffness(grains.radius[here], mass[here], name, floor, body.solid_densities[k])
    fields = dict(grains)
    fields.update(mass=mass, density=rho, material=material, species=species, stiffness=stiffness)
    return Particles(fields, grains.attributes, grains.tables)


def levelled(grains: Particles, bed: Assembly, domain: Cone, g: float) -> Particles:
    """The grains with the weight of the solid layer on the liquid one levelled, so that the bed does not slosh in
    its cone.

    A bed whose solid layer is slightly heavier on one side creeps over to the other, under the drag at v = a /
    rate; a gradient of the solid grains' mass of a R / (g H_s) per R (parts in a thousand) takes the force away.
    Without the drag that mode would swing for hours.
    """
    solid = grains.species != SPECIES.index("ocean")
    if not solid.any() or solid.all():
        return grains
    radius = domain.datum
    thickness = float(np.sum(grains.mass[solid] / grains.density[solid])) / (domain.solid_angle * radius**2)
    slope = LEVEL_GAIN * bed_measures.creep(bed) * float(bed.drag[0]) / (g * thickness)
    mass = grains.mass.copy()
    before = mass.sum()
    mass[solid] *= 1.0 + grains.position[solid, :2] @ slope
    grains["mass"] = mass * (before / mass.sum())
    return grains
