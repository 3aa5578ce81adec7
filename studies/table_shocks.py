"""The production kernels with the tables that ship, against their own exact shocks, as one table.

    python studies/table_shocks.py [--layers 100] [--only quartz]

Pistons into a strengthless fluid at rest, and the fluid beside itself as a shock left it (a shock to the right, a
rarefaction to the left: ``fixtures/riemann.py``), with Tillotson's basalt for comparison.
"""

from __future__ import annotations

import argparse
import os

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

from fixtures import columns, riemann, tables
from sph.materials.rows import Materials, collect
from sph.shock_states import hugoniot

PISTONS = (1e3, 4e3, 8e3)
BESIDE = (1e3, 8e3)


def rows(name: str, materials: Materials, layers: int) -> list[tuple[str, ...]]:
    """What was measured over what is exact, less one, in percent."""
    pressure, rest = hugoniot.solid(materials.rows, 0)
    found = []
    for speed in PISTONS:
        (wanted,) = hugoniot.waves(pressure, rest, speed)
        got = columns.shocked(materials, speed, wanted.shock_speed, layers)
        pairs = ((got.P, wanted.P), None, (got.rho, wanted.rho), (got.speed, wanted.shock_speed))
        found.append(_row(f"{name}, piston at {speed / 1e3:g} km/s", wanted.P, pairs))
    for speed in BESIDE:
        (left,) = hugoniot.waves(pressure, rest, speed)
        ends = (left.rho, left.u), (rest.rho, rest.u)
        exact, tube = riemann.star(materials, *ends), riemann.tube(materials, *ends, layers)
        pairs = (
            (tube.P, exact.P),
            (tube.v, exact.v),
            (tube.rho_right, exact.rho_right),
            (tube.speed, exact.speed),
        )
        found.append(_row(f"{name} beside itself as {speed / 1e3:g} km/s left it", exact.P, pairs))
    return found


def _row(what: str, P: float, pairs: tuple[tuple[float, float] | None, ...]) -> tuple[str, ...]:
    errors = (f"{100.0 * (pair[0] / pair[1] - 1.0):+.2f} %" if pair else "given" for pair in pairs)
    return (what, f"{P / 1e9:.1f}", *errors)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--layers", type=int, default=100, help="how far the shocks run")
    parser.add_argument("--only", default="", help="one of the tables, or basalt")
    given = parser.parse_args()
    print("| | P, GPa | error of P | of v | of the density | of the shock's speed |\n|---|---|---|---|---|---|")
    for name in (*tables.SHIPPED, "basalt"):
        if given.only in name:
            materials = tables.shipped(name) if name in tables.SHIPPED else collect((name,))
            for row in rows(name, materials, given.layers):
                print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
