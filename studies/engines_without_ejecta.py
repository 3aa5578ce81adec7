"""The bed of a handoff without its ejecta, let go for some seconds by this project, LAMMPS and LIGGGHTS: what each
loses of its momentum and energy.

    python studies/engines_without_ejecta.py RUN [--seconds T] [--out table.json]

RUN is a run folder with a handoff whose bed settled in the springs of the collapse (row E of ``studies/sci.py``).
Ejecta are left out because no engine treats them alike: some begin inside grains of the bed, where this project lets
them fly until they are clear and an engine pushes them out (deviation ``ejecta_not_slowed``). LIGGGHTS has no twisting
spring and stands beside a run of our own without one. Prints, and writes where ``--out`` says, the vertical momentum
[kg m/s] and the kinetic energy with that of the spins [J] at the end, what was lost of the latter, and by how much an
engine's loss differs from ours.
"""

from __future__ import annotations

import argparse
import csv
import json
import tempfile
from pathlib import Path

import numpy as np

from dem import stage
from dem.engines import deviations
from dem.settings import Settings
from matter.files import snapshot
from pipeline.case import read
from pipeline.settings import checking

ROWS = 50
"""Rows of the history between start and end."""
ENGINES = {
    "this project": ("native", True, ""),
    "LAMMPS": ("lammps", True, "this project"),
    "this project, no twisting": ("native", False, ""),
    "LIGGGHTS": ("liggghts", False, "this project, no twisting"),
}
"""Engine, whether contacts resist twisting, and what it stands beside."""


def without_ejecta(run: Path, folder_path: Path) -> None:
    """Write ``folder_path`` as a run folder whose handoff is that of ``run`` with the grains of its bed alone."""
    start = snapshot.read(run / "4_handoff" / "start.vtkhdf")
    for name in ("2_sph", "4_handoff"):
        (folder_path / name).mkdir(parents=True)
    (folder_path / "2_sph" / "target.json").write_bytes((run / "2_sph" / "target.json").read_bytes())
    snapshot.write(
        start.select(start.identity < start.attributes["bed_grains"]), folder_path / "4_handoff" / "start.vtkhdf"
    )


def settings_for(run: Path, engine: str, twists: bool, seconds: float) -> Settings:
    """The collapse of the run's own case for ``seconds`` on this engine, with or without springs of twisting."""
    found = checking.settings_of(read.read(run / "case.used.toml"), ("dem",))["dem"]
    assert isinstance(found, Settings)
    begin = float(snapshot.attributes(run / "4_handoff" / "start.vtkhdf")["time"])
    laws = (
        {}
        if twists
        else {name: getattr(found.contact, name).model_copy(update={"twisting": 0.0}) for name in ("shell", "ocean")}
    )
    return found.model_copy(
        update={
            "engine": engine,
            "accept": tuple(deviations.SENTENCES),
            "contact": found.contact.model_copy(update=laws),
            "end_time": begin + seconds,
            "latest_time": begin + seconds,
            "history_interval": seconds / ROWS,
            "snapshot_interval": seconds,
        }
    )


def books(folder: Path, seconds: float) -> dict[str, float]:
    """Momentum and kinetic energy (with the spins') at the start and ``seconds`` on, from the history, linear between
    its rows."""
    with (folder / "history.csv").open() as lines:
        rows = [{key: float(value or "nan") for key, value in row.items()} for row in csv.DictReader(lines)]
    time = np.array([row["time_s"] for row in rows])
    energy = np.array([row["kinetic_J"] + row["rotational_J"] for row in rows])
    momentum = np.array([row["momentum_z"] for row in rows])
    end = min(time[0] + seconds, time[-1])
    return {
        "p_z_start": float(momentum[0]),
        "p_z_end": float(np.interp(end, time, momentum)),
        "energy_start_J": float(energy[0]),
        "energy_end_J": float(np.interp(end, time, energy)),
    }


def main() -> None:
    """Run the engines one after the other and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    table: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        folder_path = Path(folder) / "run"
        without_ejecta(given.run, folder_path)
        for name, (engine, twists, beside) in ENGINES.items():
            out = Path(folder) / name.replace(" ", "_").replace(",", "")
            out.mkdir()
            stage.run(settings_for(given.run, engine, twists, given.seconds), folder_path, out)
            row = table[name] = books(out, given.seconds)
            row["lost_J"] = row["energy_start_J"] - row["energy_end_J"]
            row["gained_p_z"] = row["p_z_end"] - row["p_z_start"]
            if beside:
                for key in ("lost_J", "gained_p_z"):
                    row[f"{key}_over_ours"] = row[key] / table[beside][key] - 1.0
            print(name, "  ".join(f"{key} {value:.6g}" for key, value in row.items()), flush=True)
    if given.out:
        given.out.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
