"""Which crush curve a material has, chosen by ``kind`` and fed from a row of numbers (``Parameters`` in their order; a table as ``crush_table.row``)."""

from matter.jit import law
from sph.porosity import crush_quadratic, crush_table, crush_two_power

LAWS = ("quadratic", "two_power", "table")
MODULES = (crush_quadratic, crush_two_power, crush_table)
WIDTH = 1 + 2 * crush_table.MOST
QUADRATIC, TWO_POWER, TABLE = range(3)


@law
def openness(kind, row, P):
    """(alpha - 1) / (alpha_s - 1) on the crush curve at pressure P [Pa]."""
    if kind == QUADRATIC:
        return crush_quadratic.openness(P, crush_quadratic.Parameters(row[0], row[1]))
    if kind == TWO_POWER:
        return crush_two_power.openness(P, crush_two_power.Parameters(row[0], row[1], row[2], row[3], row[4], row[5], row[6]))
    return crush_table.openness(P, row)


@law
def slope(kind, row, P):
    """Its derivative with P [1/Pa]."""
    if kind == QUADRATIC:
        return crush_quadratic.slope(P, crush_quadratic.Parameters(row[0], row[1]))
    if kind == TWO_POWER:
        return crush_two_power.slope(P, crush_two_power.Parameters(row[0], row[1], row[2], row[3], row[4], row[5], row[6]))
    return crush_table.slope(P, row)


@law
def onset(kind, row):
    """The pressure [Pa] at which crushing starts."""
    if kind == QUADRATIC:
        return row[0]
    if kind == TWO_POWER:
        return row[2]
    return row[1]
