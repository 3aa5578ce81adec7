"""Files as OpenSPH and miluphcuda write them, put together from the descriptions of their own writers (never from the
readers tested on them)."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

# OpenSPH: quantity identifiers, and the numbers per value of its types
POSITION, MASS, PRESSURE, DENSITY, ENERGY, STRESS, DAMAGE, FLAG = 0, 1, 2, 3, 4, 6, 10, 42
SCALAR, VECTOR, TRACELESS, INDEX = 0, 1, 4, 5
ZERO, FIRST, SECOND = 0, 1, 2

DUMP = "ITEM: UNITS\ncgs\n" + "".join(
    f"ITEM: TIME\n{step}.5\nITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n3\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n"
    "0 1\nITEM: ATOMS id type x y z vx vy vz radius mass c_pe\n"
    "1 1 1 2 3 0 0 0 0.5 3 0\n2 2 4 5 6 0 0 0 0.5 3 0\n3 1 7 8 9 0 0 0 0.5 3 0\n"
    for step in (0, 100)
)
"""LAMMPS: two steps of three atoms, with units and times."""


def ssf(path: Path, bodies: list[dict], version: int = 20210808, kind: bytes = b"sph", attractors: int = 0) -> None:
    """An OpenSPH state file. A body: ``name`` and arrays ``position`` (n, 4), ``velocity`` (n, 4), ``mass``,
    ``density``, ``energy``, ``pressure``, ``stress`` (n, 5) as xx yy xy xz yz, ``damage``, ``flag``."""
    table = [
        (POSITION, SECOND, VECTOR), (MASS, ZERO, SCALAR), (PRESSURE, ZERO, SCALAR), (DENSITY, FIRST, SCALAR), (ENERGY,
        FIRST, SCALAR),
        (STRESS, FIRST, TRACELESS), (DAMAGE, FIRST, SCALAR), (FLAG, ZERO, INDEX),
    ]  # fmt: skip
    count = sum(len(body["mass"]) for body in bodies)
    out = b"SPH\0" + struct.pack("<dqqqdq", 12.5, count, len(table), len(bodies), 0.25, version)
    out += kind.ljust(16, b"\0") + b"Nov 21 2026".ljust(16, b"\0") + struct.pack("<qq", 77, attractors)
    out += b"\0" * (256 - len(out))
    out += b"".join(struct.pack("<qqq", *row) for row in table)
    first = 0
    for number, body in enumerate(bodies):
        n = len(body["mass"])
        out += b"MAT\0" + struct.pack("<qq", number, 5)
        out += struct.pack("<qqqq", 0, 8, 3, 0)  # an enum and its dummy
        out += struct.pack("<qqq", 4, 0, 1)  # a bool
        out += struct.pack("<qqdd", 8, 3, 0.0, 1.0)  # an interval
        out += struct.pack("<qq5d", 13, 7, *range(5))  # a traceless tensor
        out += struct.pack("<qq", 99, 4) + body["name"].encode() + b"\0"
        out += b"".join(struct.pack("<qddd", row[0], 0.0, 1.0, 0.1) for row in table)
        out += struct.pack("<qq", first, first + n)
        first += n
        nothing = np.zeros(n)
        for values in (
            body["position"], body["velocity"], np.full((n, 4), 9.0), body["mass"], body["pressure"], body["density"],
            nothing, body["energy"], nothing,
            body["stress"], np.full((n, 5), 8.0), body["damage"], nothing,
        ):  # fmt: skip
            out += np.ascontiguousarray(values, dtype="<f8").tobytes()
        out += np.ascontiguousarray(body["flag"], dtype="<i8").tobytes()
    for _ in range(attractors):
        out += struct.pack("<10d", *range(10)) + struct.pack("<q", 1) + struct.pack("<qq", 2, 4) + b"a star\0"
    path.write_bytes(out)


def body(n: int, seed: int, name: str = "basalt") -> dict:
    """Random values for one material of ``ssf``."""
    rng = np.random.default_rng(seed)
    return {
        "name": name, "position": rng.normal(size=(n, 4)) ** 2, "velocity": rng.normal(size=(n, 4)),
        "mass": rng.random(n), "density": 2700 + rng.random(n),
        "energy": rng.random(n), "pressure": rng.normal(size=n), "stress": rng.normal(size=(n, 5)),
        "damage": rng.random(n), "flag": rng.integers(0, 5, n),
    }  # fmt: skip


def miluphcuda_values(n: int, seed: int) -> dict[str, np.ndarray]:
    """Random values under the dataset names of miluphcuda's HDF5 files."""
    rng = np.random.default_rng(seed)
    stress = rng.normal(size=(n, 3, 3))
    stress = stress + stress.transpose(0, 2, 1)
    stress -= np.eye(3) * np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3.0
    return {
        "x": rng.normal(size=(n, 3)), "v": rng.normal(size=(n, 3)), "a": rng.normal(size=(n, 3)),
        "a_grav": rng.normal(size=(n, 3)),
        "time": np.array([33.0]), "m": rng.random(n) + 1.0, "rho": rng.random(n) + 2700.0, "e": rng.random(n),
        "sml": rng.random(n) + 0.5,
        "number_of_interactions": rng.integers(20, 90, n), "material_type": rng.integers(0, 3, n),
        "p": rng.normal(size=n), "soundspeed": rng.random(n),
        "alpha_jutzi": 1.0 + rng.random(n), "DIM_root_of_damage_tensile": rng.random(n),
        "number_of_activated_flaws": rng.integers(0, 2, n),
        "deviatoric_stress": stress.reshape(n, 9), "local_strain": rng.random(n), "tree_depth": np.full(n, 7),
    }  # fmt: skip


def miluphcuda_text(path: Path, values: dict[str, np.ndarray], solid: bool, flaws: bool, porous: bool) -> None:
    """The text file for the same values, column for column with the formats of its ``fprintf`` calls; particle i has i
    % 4 flaws."""
    lines = []
    for i in range(len(values["m"])):
        line = "".join(f"{number:+.15e}\t" for number in (*values["x"][i], *values["v"][i]))
        line += f"{values['m'][i]:e}\t{values['rho'][i]:e}\t{values['e'][i]:e}\t{values['sml'][i]:.6e}\t"
        line += f"{values['number_of_interactions'][i]:d}\t{values['material_type'][i]:d}\t"
        if flaws:
            line += f"{i % 4:d}\t{0:d}\t{values['DIM_root_of_damage_tensile'][i]:.6e}\t"
        if not porous:
            line += f"{values['p'][i]:e}\t"
        if solid:
            line += "".join(
                f"{number:.6e}\t" for number in (values["local_strain"][i], *values["deviatoric_stress"][i])
            )
        if porous:
            line += f"{values['alpha_jutzi'][i]:.6e}\t{values['p'][i]:.6e}\t"
        if flaws:
            line += "".join(f"{0.001 * k:.6e}\t" for k in range(i % 4))
        lines.append(line + "\n")
    path.write_text("".join(lines))
    path.with_name(path.name + ".info").write_text(
        f"Information about particle data of file {path.name}\nTime: \t {33.0:.20e}\nTotal mass: \t 1\n"
    )
