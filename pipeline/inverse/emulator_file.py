"""``emulator.h5``: the members and the fitted emulators of an inversion, so that it is asked again without the runs.

    parameters/NAME       (n,)       what was drawn for each member [SI]; of "choices" the number of the value, from 0
    measures/NAME/value   (n,)       what it came to [SI], NaN where it has none
    measures/NAME/sigma   (n,)       its standard error [SI]
    kernels/NAME          (d + 3,)   what was fitted of an emulator (``pipeline.inverse.emulator``)

Attributes: ``seed``; ``chain NAME`` and ``draws NAME``, the chain error of ln of a measure and the part of it that
other random draws make. What was asked of them and what came out stands beside it in ``inverse.toml``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.files import archive, toml_input
from pipeline.inverse import emulator
from pipeline.inverse.design import Design, unit_of
from pipeline.inverse.inversion import Inversion, read_table, words_of
from pipeline.inverse.inversion import unit_of as unit_of_measure
from pipeline.inverse.posterior import Observed
from pipeline.sweeps import sweep as sweeps

FILE, TABLE = "emulator.h5", "inverse.toml"
_FAILED, _COMMAND = "failed_members", "command"


def write(found: Inversion) -> None:
    """Write the file into the folder of an inversion."""
    made: dict[str, Any] = {}
    for k, (name, unit) in enumerate(zip(found.design.names, found.design.units)):
        made[f"parameters/{name}"] = (found.design.theta[:, k], unit, f"{name} of each member")
    for name, (value, sigma) in found.design.columns.items():
        unit, words = unit_of_measure(name), words_of(name)
        made[f"measures/{name}/value"] = (value, unit, words)
        made[f"measures/{name}/sigma"] = (sigma, unit, f"{words}: standard error")
    for one in found.observed:
        made[f"kernels/{one.name}"] = (
            found.emulator(one.name).kernel, "1", "ln of variance, lengths, scale of the slope and nugget"
        )  # fmt: skip
    errors = {f"{kind} {name}": value for kind, of in (("chain", found.chains), ("draws", found.noise))
              for name, value in of.items()}  # fmt: skip
    archive.write(found.folder / FILE, made, {"seed": found.seed, **errors})


def table(found: Inversion) -> dict[str, Any]:
    """What ``inverse.toml`` says for ``read``."""
    return {
        "name": found.name, _COMMAND: found.command, _FAILED: [list(one) for one in found.design.failed],
        "inverse": found.table.model_dump(mode="json"), "sweep": dict(found.sweep),
    }  # fmt: skip


def read(folder: Path) -> Inversion:
    """The inversion whose files lie in ``folder``; nothing is run, and no case is read. Raises ``InputError`` where
    one is missing or damaged."""
    emulator.require()
    folder = Path(folder)
    try:
        told = toml_input.loads((folder / TABLE).read_text())
    except (OSError, ValueError) as reason:
        raise InputError(f"{folder / TABLE}: {reason}") from None
    arrays, attributes = archive.read(folder / FILE)
    try:
        priors = sweeps.read_table(told["sweep"], ()).prior
        theta = np.stack([arrays[f"parameters/{name}"] for name in priors], axis=1)
        names = [name.removeprefix("measures/").removesuffix("/value") for name in arrays if name.endswith("/value")]
        columns = {name: tuple(arrays[f"measures/{name}/{part}"] for part in ("value", "sigma")) for name in names}
        observed = [
            Observed(one["name"], one["unit"], *(float(one[key]) for key in
                     ("value", "minus", "plus", "chain_fraction", "discrepancy_fraction")))
            for one in told["observed"]
        ]  # fmt: skip
        kernels = {one.name: arrays[f"kernels/{one.name}"] for one in observed}
        chains, noise = ({name: float(attributes[f"{kind} {name}"]) for name in names} for kind in ("chain", "draws"))
        failed = [(str(member), str(reason)) for member, reason in told[_FAILED]]
        design = Design(tuple(priors), tuple(map(unit_of, priors.values())), theta, columns, failed)  # type: ignore[arg-type]
        return Inversion(
            told["name"], told[_COMMAND], read_table(told["inverse"]), told["sweep"], priors, design, observed, chains,
            noise, folder, int(attributes["seed"]), kernels,
        )  # fmt: skip
    except (KeyError, TypeError, ValueError) as reason:
        raise InputError(f"{folder}: {TABLE} and {FILE} are not those of one inversion: {reason!r}") from None
