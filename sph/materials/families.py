"""The families of laws that a material chooses from: the settings of a material, its rows of numbers and the
bibliography are derived from this list."""

from sph.damage import growth
from sph.eos import dispatch as eos
from sph.porosity import crush
from sph.porosity import dispatch as porosity
from sph.strength import dispatch as strength

FAMILIES = (eos.FAMILY, strength.FAMILY, porosity.FAMILY, crush.FAMILY, growth.FAMILY)
