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
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.files import hdf5_input
from matter.formats import numbers
from matter.formats.reading import Reading
from matter.formats.words import short

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
_DAMAGE = {"damage_total_porjutzi": 1, "DIM_root_of_damage_tensile": _DIM}
"""Datasets of damage, the first that is there is taken, and the power of each that is the damage."""
_FIELD = {
    "m": "mass",
    "rho": "density",
    "e": "specific_energy",
    "sml": "smoothing_length",
    "noi": "neighbours",
    "material": "material",
    "p": "pressure",
    "alpha": "distention",
}


def is_one(names: set[str]) -> bool:
    """Whether an HDF5 file with datasets of these ``names`` at its top is miluphcuda's."""
    return {"x", "v", "m", "rho", "material_type"} <= names


def read(path: Path, columns: str | None = None) -> Reading:
    """What an output file holds, HDF5 or text (``columns``: see the module). Raises ``InputError``."""
    with open(path, "rb") as file:
        head = file.read(8)
    return _read_hdf5(Path(path)) if head == b"\x89HDF\r\n\x1a\n" else _read_text(Path(path), columns)


def _read_hdf5(path: Path) -> Reading:
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
        taken = [(field, hdf5_input.array(file, name), name) for name, field in _DATASETS.items() if name in file]
        others = [name for name in file if name not in (*_DATASETS, "time")]
        if "deviatoric_stress" in file:
            stress = hdf5_input.array(file, "deviatoric_stress").reshape(-1, 9)[:, _UPPER]
            taken.append(("deviatoric_stress", stress, "deviatoric_stress"))
        damaged = next((name for name in _DAMAGE if name in file), None)
        if damaged is not None:
            taken.append(("damage", np.minimum(hdf5_input.array(file, damaged) ** _DAMAGE[damaged], 1.0), damaged))
        if "time" in file:
            time = [float(value) for value in np.ravel(hdf5_input.array(file, "time"))[:1]]
        else:
            time = _time_of(path.with_suffix(""))
    reading = _active(path, taken, time)
    reading.leave(*(name for name in others if name not in ("deviatoric_stress", damaged)))
    return reading


def _read_text(path: Path, columns: str | None) -> Reading:
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
        rows.append((number, " ".join(words[: len(names)])))
    if not rows:
        raise InputError(f"{path} holds no data")
    table = numbers.table(rows, path)
    column = {name: table.values[:, k] for k, name in enumerate(names)}
    taken = [
        ("position", np.stack([column[name] for name in ("x", "y", "z")], axis=1), "x y z"),
        ("velocity", np.stack([column[name] for name in ("vx", "vy", "vz")], axis=1), "vx vy vz"),
        *((_FIELD[name], table.values[:, k], name) for k, name in enumerate(names) if name in _FIELD),
    ]
    if "SOLID" in on:
        taken.append(("deviatoric_stress", np.stack([column[f"S{k}"] for k in _UPPER], axis=1), "S"))
    if flawed:
        taken.append(("damage", np.minimum(column["d"] ** _DIM, 1.0), "d"))
    reading = _active(path, taken, _time_of(path))
    known = {*_FIELD, *"x y z vx vy vz d".split()}
    reading.leave(*(name for name in names if name not in known and not re.fullmatch(r"S\d", name)))
    if flawed:
        reading.leave("activation thresholds")
    return reading


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


def _time_of(path: Path) -> list[float]:
    """Time [s] from the ``.info`` file that the program writes beside its output; none without one.

    Raises ``InputError`` where what stands there is no number.
    """
    info = path.with_name(path.name + ".info")
    match = re.search(r"^Time:\s*(\S+)", numbers.text(info), re.MULTILINE) if info.is_file() else None
    if match is None:
        return []
    if not numbers.is_number(match.group(1)):
        raise InputError(f"{info}: the time {short(match.group(1))} is not a number")
    return [float(match.group(1))]


def _active(path: Path, taken: Sequence[tuple[str, Any, str]], time: list[float]) -> Reading:
    """What the file holds of the particles that are not deactivated, in its order. Raises ``InputError``."""
    material = np.ravel(next(values for field, values, _ in taken if field == "material"))
    alive, reading = material >= 0, Reading(path)
    reading.attributes["stage"] = "sph"
    reading.take("identity", np.flatnonzero(alive), "order")
    for field, values, name in taken:
        if np.ndim(values) == 0 or len(values) != len(alive):
            raise InputError(f"{path}: {name} has {np.size(values)} values for {len(alive)} particles")
        reading.take(field, np.asarray(values)[alive], name)
    if time:
        reading.at(time[0], "time")
    if deactivated := int(np.count_nonzero(~alive)):
        reading.leave(f"{deactivated} deactivated particles")
    return reading
