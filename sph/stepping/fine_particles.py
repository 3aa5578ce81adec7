"""Particles finer than those of the crater, in the late stage: softer, so that they do not hold up the steps of all.

The contact asks for particles of half to a quarter of the spacing at which the crater is resolved. Once the shock has
left they are few and strewn over floor and ejecta, mostly without pressure, and yet the step of all others is theirs,
C h_i / c. So their medium (``sph.stepping.late``) has the sound speed

    c_i = c max(SOFTEST, min(1, (m_i / m)^(1/3)))

with m the mass of a particle of ``spacing_at_impact``, and so a bulk and a shear modulus that go by the square of it.
c exceeds the flow ten times (``sph.planning.late_speeds``), their own sound speed at least five times: their density
then follows the flow to (v / c_i)^2, 4 %. A gas and matter that is softer by itself keep their moduli.
"""

from __future__ import annotations

from matter.compilation.jit import law

SOFTEST = 0.5
"""Least sound speed of a fine particle over that of the medium."""


@law
def softness(mass, full):
    """K_i / K = (c_i / c)^2 of a particle of ``mass``, where one of the mass ``full`` has K; 1 where that is 0."""
    if mass >= full:
        return 1.0
    return max((mass / full) ** (2.0 / 3.0), SOFTEST * SOFTEST)
