"""Which crush curve a material has, chosen by ``kind`` and fed from a row of numbers; a law file defines ``openness``,
``slope`` and ``onset``."""

from matter.compilation.law_family import Family
from sph.porosity import crush_quadratic, crush_two_power

FAMILY = Family("crush", "crush curve", (crush_quadratic, crush_two_power), prefix="crush_", by_values=True)

openness = FAMILY.choose("openness", "P", about="(alpha - 1) / (alpha_s - 1) on the crush curve at pressure P [Pa].")
slope = FAMILY.choose("slope", "P", about="Its derivative with P [1/Pa].")
onset = FAMILY.choose("onset", "", about="The pressure [Pa] at which crushing starts.")
