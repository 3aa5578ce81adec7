"""A table of an equation of state from M-ANEOS (github.com/isale-code/M-ANEOS), in the format that bolide reads.

    python studies/maneos_table.py PROGRAM INPUT OUT [--rho0 2650] [--title "..."] [--between FILE.csv]

``PROGRAM`` is the compiled ``m-aneos``, ``INPUT`` one of its material files, ``OUT`` the table (``.txt`` or
``.txt.xz``). The grid: densities close together from 0.85 to 2.2 rho0, wide apart in vapour and above, and 141
temperatures from 50 to 150,000 K, closest together from 1000 to 12,000 K. Values are written with nine digits, all
that the program gives: in cold, dense matter heat is a small share of the energy. ``--between`` also writes states of
the program halfway between the nodes, every 9th density and 7th temperature from 1 kg/m^3 and 100 K on: what
interpolation is held against.
"""

from __future__ import annotations

import argparse
import lzma
import shutil
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path

import numpy as np


def grid(rho0: float) -> tuple[np.ndarray, np.ndarray]:
    """Densities [kg/m^3] and temperatures [K] of the nodes."""
    pieces = ((1e-5, 0.3 * rho0, 70), (0.3 * rho0, 0.85 * rho0, 40), (0.85 * rho0, 2.2 * rho0, 130))
    rho = _joined(*pieces, (2.2 * rho0, 12.0 * rho0, 40))
    return _rounded(rho * 1e-3) * 1e3, _rounded(_joined((50.0, 1e3, 30), (1e3, 1.2e4, 61), (1.2e4, 1.5e5, 52)))


def _joined(*pieces: tuple[float, float, int]) -> np.ndarray:
    """Geometric series from end to end, each with its number of nodes, both ends among them."""
    return np.concatenate([*(np.geomspace(a, b, n)[:-1] for a, b, n in pieces[:-1]), np.geomspace(*pieces[-1])])


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.array([float(f"{value:.6E}") for value in values])


def _body(path: Path, columns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Densities [g/cm^3], temperatures and (columns, k, n) values of one of the two files that M-ANEOS writes."""
    lines = path.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if "TYPE =  301" in line) + 1
    numbers = np.array(" ".join(lines[start:]).split(), dtype=float)
    n, k = int(numbers[0]), int(numbers[1])
    return numbers[2 : 2 + n], numbers[2 + n : 2 + n + k], numbers[2 + n + k :].reshape(columns, k, n)


def between(rho: np.ndarray, T: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Densities and temperatures halfway between nodes."""
    middle, warm = np.sqrt(rho[1:] * rho[:-1]), np.sqrt(T[1:] * T[:-1])
    return _rounded(middle[middle > 1.0][::9] * 1e-3) * 1e3, _rounded(warm[warm > 100.0][::7])


def made(program: Path, material: Path, rho0: float, rho: np.ndarray, T: np.ndarray) -> np.ndarray:
    """What the program says at densities and temperatures: (k, n, 4) values u P c s in SI."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(material, Path(folder) / "ANEOS.INPUT")
        head = [1.0, 1.0, 1.0, 1.0, 1.0, rho0 * 1e-3, 1.0, 298.0, len(rho), len(T)]
        numbers = [*head, *(rho * 1e-3), *T]
        (Path(folder) / "tablegrid.txt").write_text("".join(f"{number:.6E}\n" for number in numbers))
        subprocess.run([str(program.resolve()), "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        _, _, (P, u, _free) = _body(Path(folder) / "NEW-SESAME-STD.TXT", 3)
        _, _, (s, c, _cv, _kpa) = _body(Path(folder) / "NEW-SESAME-EXT.TXT", 4)
    return np.stack([u * 1e6, P * 1e9, c * 1e-2, s * 1e6], axis=-1)


def text(header: list[str], rho: np.ndarray, T: np.ndarray, values: np.ndarray) -> str:
    """The table as text, ``values`` (k, n, 4)."""
    if len(header) > 12:
        raise ValueError(f"the header has {len(header)} lines; there is room for 12")
    lines = [f"# {line}".rstrip() for line in header + [""] * (12 - len(header))]
    lines += [f"{date.today():%Y%m%d}", f"{len(rho)} {len(T)}"]
    lines += [" ".join(f"{value:.6E}" for value in axis) for axis in (rho, T)]
    lines += [" ".join(f"{value:.8E}" for value in node) for node in values.reshape(-1, 4)]
    return "\n".join(lines) + "\n"


def main() -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("input", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--rho0", type=float, default=2650.0, help="density at rest [kg/m^3]")
    parser.add_argument("--title", default="", help="first line of the header")
    parser.add_argument("--between", type=Path, help="states halfway between the nodes, as CSV")
    given = parser.parse_args()
    rho, T = grid(given.rho0)
    values = made(given.program, given.input, given.rho0, rho, T)
    header = [given.title, f"M-ANEOS, input {given.input.name}", "u [J/kg] P [Pa] c [m/s] s [J/(kg K)]"]
    content = text(header, rho, T, values).encode()
    given.out.write_bytes(lzma.compress(content, preset=9) if given.out.suffix == ".xz" else content)
    print(f"{given.out}: {len(rho)} densities, {len(T)} temperatures, {given.out.stat().st_size / 1e3:.0f} kB")
    if given.between:
        rho, T = between(rho, T)
        states = made(given.program, given.input, given.rho0, rho, T)
        rows = [(r, t, *states[j, i]) for j, t in enumerate(T) for i, r in enumerate(rho)]
        given.between.write_text("rho,T,u,P,c,s\n" + "".join(",".join(f"{v:.9g}" for v in row) + "\n" for row in rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
