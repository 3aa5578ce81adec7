"""miluphcuda's output, HDF5 (``impact.0012.h5``) and text (``impact.0012``).

Names and order are those of its own ``write_particles_to_file`` (``src/io.cu``, commit eea2c5e). The columns of the
text file depend on the switches that the program was compiled with (``parameter.h``), which the file does not say:
they are given as ``columns``, ``"INTEGRATE_ENERGY,SOLID,FRAGMENTATION"``. In three dimensions a line holds

x y z  vx vy vz  m rho  [e]  sml  interactions  material  [JC: plastic strain, temperature]  [FRAGMENTATION: flaws,
active flaws, d] [p, unless PALPHA_POROSITY]  [SOLID: local strain, S (9)]  [NAVIER_STOKES: (9)]  [SIRONO_POROSITY:
(9)]  [PALPHA_POROSITY: alpha, p] [EPSALPHA_POROSITY: alpha, strain]  [FRAGMENTATION: one activation threshold per
flaw]

``sml`` is the kernel's support radius; d is the cube root of the damage; deactivated particles (material -1) are left
out. Pressure and stress are taken as stored: there, damage acts on tension only where the stress is put together (with
COLLINS_PLASTICITY it is in the pressure).
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from matter import hdf5_input
from matter.errors import InputError
from matter.formats import numbers
from matter.particles import Particles

SWITCHES = (
    "INTEGRATE_ENERGY",
    "JC_PLASTICITY",
    "FRAGMENTATION",
    "SOLID",
    "NAVIER_STOKES",
    "SIRONO_POROSITY",
    "PALPHA_POROSITY",
    "EPSALPHA_POROSITY",
)
_DIM = 3
_UPPER = (0, 1, 2, 4, 5, 8)  # xx xy xz yy yz zz among nine
_DATASETS = {
    "x": "position",
    "v": "velocity",
    "m": "mass",
    "rho": "density",
    "e": "specific_energy",
    "sml": "smoothing_length",
    "number_of_interactions": "neighbours",
    "material_type": "material",
    "p": "pressure",
    "soundspeed": "sound_speed",
    "p_max": "peak_pressure",
    "a_grav": "gravity",
    "alpha_jutzi": "distention",
    "alpha_epspor": "distention",
}
_FIELD = {
    "m": "mass",
    "rho": "density",
    "e": "specific_energy",
    "sml": "smoothing_length",
    "noi": "neighbours",
    "material": "material",
    "p": "pressure",
}


def is_one(names: set[str]) -> bool:
    """Whether an HDF5 file with datasets of these ``names`` at its top is miluphcuda's."""
    return {"x", "v", "m", "rho", "material_type"} <= names


def read(path: Path, columns: str | None = None) -> Particles:
    """Particles of an output file, HDF5 or text (``columns``: see the module). Raises ``InputError``."""
    with open(path, "rb") as file:
        head = file.read(8)
    return _read_hdf5(Path(path)) if head == b"\x89HDF\r\n\x1a\n" else _read_text(Path(path), columns)


def _read_hdf5(path: Path) -> Particles:
    with hdf5_input.opened(path) as file:
        missing = [name for name in ("x", "v", "m", "rho", "material_type") if name not in file]
        if missing:
            raise InputError(
                f"{path} lacks the dataset{'s' if len(missing) > 1 else ''} {', '.join(missing)}: not miluphcuda's "
                f"output"
            )
        if file["x"].ndim != 2 or file["x"].shape[1] != _DIM:
            raise InputError(
                f"{path}: positions of shape {file['x'].shape}; only runs in three dimensions can be used"
            )
        fields = {field: hdf5_input.array(file, name) for name, field in _DATASETS.items() if name in file}
        if "deviatoric_stress" in file:
            fields["deviatoric_stress"] = hdf5_input.array(file, "deviatoric_stress").reshape(-1, 9)[:, _UPPER]
        if "damage_total_porjutzi" in file:
            fields["damage"] = np.minimum(hdf5_input.array(file, "damage_total_porjutzi"), 1.0)
        elif "DIM_root_of_damage_tensile" in file:
            fields["damage"] = np.minimum(hdf5_input.array(file, "DIM_root_of_damage_tensile") ** _DIM, 1.0)
        time = float(np.ravel(hdf5_input.array(file, "time"))[0]) if "time" in file else _time_of(path.with_suffix(""))
    return _active(fields, time)


def _read_text(path: Path, columns: str | None) -> Particles:
    if columns is None:
        raise InputError(
            f"{path}: a text file of miluphcuda does not describe its columns; name the switches that were 1 in its "
            f"parameter.h, "
            f"--columns 'INTEGRATE_ENERGY,SOLID' for example (known: {', '.join(SWITCHES)})"
        )
    on = {word.strip().upper() for word in columns.split(",") if word.strip()}
    if unknown := sorted(on - set(SWITCHES)):
        raise InputError(
            f"--columns: {', '.join(unknown)} decides no column of miluphcuda's text files (known: "
            f"{', '.join(SWITCHES)})"
        )
    names = column_names(on)
    flawed, rows = "FRAGMENTATION" in on, []
    for number, line in enumerate(numbers.text(path).splitlines(), 1):
        words = line.split()
        if not words:
            continue
        told = words[names.index("flaws")] if flawed and len(words) > names.index("flaws") else "0"
        flaws = int(told) if told.isdigit() else 0
        if len(words) != len(names) + flaws or not told.isdigit():
            raise InputError(
                f"{path}, line {number}: {len(words)} numbers, {len(names) + flaws} expected with {columns}: were "
                f"other switches on?"
            )
        rows.append(words[: len(names)])
    if not rows:
        raise InputError(f"{path} holds no data")
    try:
        table = dict(zip(names, np.array(rows, dtype=float).T))
    except ValueError as reason:
        raise InputError(f"{path}: {reason}") from None
    fields = {field: table[name] for name, field in _FIELD.items() if name in table}
    fields["position"] = np.stack([table[name] for name in ("x", "y", "z")], axis=1)
    fields["velocity"] = np.stack([table[name] for name in ("vx", "vy", "vz")], axis=1)
    if "SOLID" in on:
        fields["deviatoric_stress"] = np.stack([table[f"S{k}"] for k in _UPPER], axis=1)
    if flawed:
        fields["damage"] = np.minimum(table["d"] ** _DIM, 1.0)
    if "alpha" in table:
        fields["distention"] = table["alpha"]
    return _active(fields, _time_of(path))


def column_names(on: set[str]) -> list[str]:
    """Names of the columns of a text file (without the activation thresholds at its end) for the switches that were
    on."""
    names = [*"x y z vx vy vz m rho".split(), *(["e"] if "INTEGRATE_ENERGY" in on else []), "sml", "noi", "material"]
    names += ["ep", "T"] if "JC_PLASTICITY" in on else []
    names += ["flaws", "active", "d"] if "FRAGMENTATION" in on else []
    names += ["p"] if "PALPHA_POROSITY" not in on else []
    names += ["strain", *(f"S{k}" for k in range(9))] if "SOLID" in on else []
    names += [f"shear{k}" for k in range(9)] if "NAVIER_STOKES" in on else []
    names += [f"sirono{k}" for k in range(9)] if "SIRONO_POROSITY" in on else []
    names += ["alpha", "p"] if "PALPHA_POROSITY" in on else []
    return names + (["alpha", "epsilon_v"] if "EPSALPHA_POROSITY" in on else [])


def _time_of(path: Path) -> float | None:
    """Time [s] from the ``.info`` file that the program writes beside its output; None without one."""
    info = path.with_name(path.name + ".info")
    match = re.search(r"^Time:\s*(\S+)", info.read_text(), re.MULTILINE) if info.is_file() else None
    return float(match.group(1)) if match else None


def _active(fields: dict[str, Any], time: float | None) -> Particles:
    alive = np.asarray(fields["material"]) >= 0
    kept = {"identity": np.flatnonzero(alive)} | {name: np.asarray(values)[alive] for name, values in fields.items()}
    return Particles(kept, {"stage": "sph"} | ({"time": time} if time is not None else {}))
