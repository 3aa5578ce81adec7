"""How stiff the solid is that grains are made of: what bounds the springs of their contacts."""

from __future__ import annotations

import math

from matter.case import at_rest, material


def elastic(material_name: str, solid_density: float | None = None) -> tuple[float, float]:
    """Bulk modulus [Pa] and bulk sound speed sqrt(K / rho0) [m/s] of a material; ``solid_density`` [kg/m^3] is rho0
    where the case gives its own (None: that of the material's file). Raises ``InputError`` for an unknown material."""
    bulk = float(material.section(material_name, "elastic")["bulk_modulus"])
    return bulk, math.sqrt(bulk / (solid_density or at_rest.of_file(material_name).solid))
