"""An inversion: priors of ``[sweep]``, what was observed by ``[inverse]``, emulators of the measures, posterior."""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from crater.comparison import observations
from matter.case import quantity
from matter.errors import InputError
from matter.wording import body_measures, crater_measures
from pipeline.case.complaints import complaints, dotted
from pipeline.case.inverse_table import InverseTable
from pipeline.case.prior_table import Prior
from pipeline.case.read import Case
from pipeline.case.stages import ORDER, SHARED_TABLES, nearest
from pipeline.inverse import design as designs
from pipeline.inverse import directions, emulator
from pipeline.inverse import posterior as posteriors
from pipeline.inverse.design import FINAL, Design
from pipeline.inverse.directions import Directions
from pipeline.inverse.emulator import Emulator
from pipeline.inverse.posterior import Observed, Posterior, Told
from pipeline.sweeps import sweep as sweeps
from pipeline.sweeps.sweep import Sweep

_MEASURES = {one.name: one for one in (*body_measures.TABLE, *crater_measures.TABLE)}


@dataclass(frozen=True)
class Inversion:
    """What was observed held against what the members came to; ``name`` of the case, the ``command`` that makes it
    again, the tables ``[inverse]`` and ``[sweep]``; ``chains``: chain error of ln of each measure; ``noise``: the part
    of it that other random draws make; ``folder``: where its files are written."""

    name: str
    command: str
    table: InverseTable
    sweep: Mapping[str, Any]
    priors: Mapping[str, Prior]
    design: Design
    observed: Sequence[Observed]
    chains: Mapping[str, float]
    noise: Mapping[str, float]
    folder: Path
    seed: int
    kernels: Mapping[str, np.ndarray] = field(default_factory=dict, repr=False)
    """Of emulators that were fitted before."""
    _made: dict[str, Emulator] = field(default_factory=dict, repr=False)

    def emulator(self, measure: str) -> Emulator:
        """The emulator of ln of a measure, of the members that have it."""
        if measure not in self._made:
            value, sigma = self.design.columns[measure]
            there = self.design.members_with(measure)
            noise = (sigma[there] / value[there]) ** 2 + self.noise.get(measure, 0.0) ** 2
            x = posteriors.all_coordinates(self.priors, self.design.theta[there])
            self._made[measure] = Emulator(x, np.log(value[there]), noise, self.seed, self.kernels.get(measure))
        return self._made[measure]

    def predict(self, theta: np.ndarray, measures: Sequence[str] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation (n, m) of ln of the ``measures`` (by default those observed) at the parameters
        ``theta`` (n, d) [SI]."""
        x = posteriors.all_coordinates(self.priors, theta)
        names = [one.name for one in self.observed] if measures is None else measures
        mean, sd = zip(*(self.emulator(name).predict(x) for name in names))
        return np.stack(mean, axis=1), np.stack(sd, axis=1)

    @cached_property
    def posterior(self) -> Posterior:
        """The posterior of what was drawn."""
        return posteriors.sampled(self.priors, self.predict, self.observed, self.seed)

    @cached_property
    def directions(self) -> Directions:
        """Which directions of the priors the data can tell apart."""
        return directions.told_apart(self.priors, self.predict, self.observed, self.seed)

    @cached_property
    def told(self) -> dict[str, Told]:
        """What the data say of each parameter."""
        return posteriors.told(self.priors, self.posterior)

    def known(self, measure: str) -> str:
        """The name of a measure among the columns of the members. Raises ``InputError`` where too few have it."""
        name = measure.removeprefix(FINAL)
        if name not in self.design.columns or self.design.members_with(name).sum() < designs.LEAST_EACH:
            known = list(self.design.columns)
            raise InputError(f"no members with a {measure!r} to predict it by{nearest(name, known)}")
        return name

    def predicted(self, measure: str, count: int = 4000) -> np.ndarray:
        """Draws (count,) [SI] of a measure by the posterior, the scatter of emulator and chain in them, the
        discrepancy not. Raises ``InputError`` where no member has it."""
        name = self.known(measure)
        mean, sd = self.predict(self.posterior.drawn(count, self.seed), [name])
        scatter = np.random.default_rng(self.seed).standard_normal(count)
        return np.asarray(np.exp(mean[:, 0] + np.hypot(sd[:, 0], self.chains.get(name, 0.0)) * scatter))


def _command(case: Case, model: str) -> str:
    """What makes the inversion of a case again."""
    named = [part for option, value in (("--preset", case.preset), ("--size", case.size)) if value
             for part in (option, value)]  # fmt: skip
    changed = [part for text in case.overrides for part in ("--set", text)]
    return shlex.join(["run_case", str(case.file), *named, *changed, "--set", f'inverse.model="{model}"', "--invert"])


def of_case(case: Case, out: Path) -> Inversion:
    """The inversion that a case asks for, or a file with ``[sweep]`` and ``[inverse]``. Raises ``InputError``."""
    asked = _asked(case)
    sweep = sweeps.planned_sweep(case, asked.content, out)
    made = designs.of_sweep(sweep, asked.content.prior, asked.table)
    designs.check(made, asked.table, asked.content.prior, out)
    return _held(case, asked, sweep, made, asked.observed, out)


def planned(case: Case, out: Path) -> tuple[Inversion | None, list[str]]:
    """The inversion before the sweep is finished, from which ``--check`` says what the data can tell apart: from the
    members that are done, or from scaling laws where they are too few for a slope by each parameter; None where the
    laws give no observed quantity. With it, what it rests on, a sentence each. Raises ``InputError``."""
    asked = _asked(case)
    sweep = sweeps.planned_sweep(case, asked.content, out)
    priors, names = asked.content.prior, [one[0] for one in asked.observed]
    if asked.table.model == "pi_scaling":
        made = designs.of_sweep(sweep, priors, asked.table)
        designs.check(made, asked.table, priors, out)
        return _held(case, asked, sweep, made, asked.observed, out), ["By scaling laws, no runs: seconds."]
    there = designs.of_sweep(sweep, priors, asked.table) if designs.has_table(sweep) else None
    done = min((int(there.members_with(name).sum()) if name in there.columns else 0 for name in names)
               if there else (0,))  # fmt: skip
    stands = [f"{done} of {len(sweep.members)} members are done: run_case {case.file} --sweep --check says what the "
              f"others cost."]  # fmt: skip
    if there and done >= len(priors) + 2:
        return _held(case, asked, sweep, there, asked.observed, out), [*stands, f"By {done} members."]
    laws = designs.of_sweep(sweep, priors, asked.table.model_copy(update={"model": "pi_scaling"}))
    given = [one for one in asked.observed if one[0] in laws.columns]
    if unknown := [name for name in names if name not in laws.columns]:
        stands.append(f"Scaling laws do not give {', '.join(unknown)}, left out here.")
    return (_held(case, asked, sweep, laws, given, out) if given else None), [*stands, "By scaling laws."]


_Given = tuple[str, str, float, float, float]
"""Name, unit, value and standard errors below and above it of what was observed."""


class _Asked(NamedTuple):
    table: InverseTable
    content: Any
    observed: list[_Given]


def _asked(case: Case) -> _Asked:
    """What a case asks for: its tables, and what was observed."""
    if not case.inverse:
        valid = ["case", *SHARED_TABLES, *ORDER, "sweep", "preset"]
        other = "".join(f", but [{table}]" for table in case.document if table not in valid)
        raise InputError(
            f"--invert goes with [inverse], and {case.file} has none{other} (run_case --describe inverse)"
        )
    table = read_table(case.inverse)
    kind = case.sweep.get("kind", "grid" if case.sweep else "")
    if kind != "prior":
        found = f'kind = "{kind}"' if kind else "no [sweep]"
        raise InputError(f'--invert takes its priors from [sweep] kind = "prior", and {case.file} has {found}')
    emulator.require()
    content = sweeps.read_table(case.sweep, ())
    observed = [_observed(name, entry, case.file.parent) for name, entry in table.observed.items()]
    for name in table.discrepancy:
        if name not in table.observed:
            raise InputError(f"[inverse] discrepancy: {name} is not observed{nearest(name, list(table.observed))}")
    return _Asked(table, content, observed)


def _held(case: Case, asked: _Asked, sweep: Sweep, made: Design, observed: Sequence[_Given], out: Path) -> Inversion:
    """What was ``observed`` held against the design ``made``."""
    table, content = asked.table, asked.content
    errors = {name: designs.chain(sweep, table.model, name) for name in made.columns}
    chains, noise = ({name: both[k] for name, both in errors.items()} for k in (0, 1))
    key = {name.removeprefix(FINAL): name for name in table.observed}
    full = [Observed(*one, chains[one[0]], table.scale(key[one[0]])) for one in observed]
    told = json.dumps([table.model_dump(mode="json"), case.sweep, case.preset, case.size, case.overrides], default=str)
    folder = out / f"{case.name}-inverse-{hashlib.sha256(told.encode()).hexdigest()[:8]}"
    words = _command(case, table.model)
    return Inversion(
        case.name, words, table, case.sweep, content.prior, made, full, chains, noise, folder, content.seed
    )


def read_table(content: Any) -> InverseTable:
    """``[inverse]`` as it was written. Raises ``InputError`` with every mistake."""
    try:
        return InverseTable.model_validate(content)
    except ValidationError as error:
        rows = [f"  {dotted(('inverse', *path))}: {words}" for path, words in complaints(InverseTable, error)]
        raise InputError(
            f"[inverse] cannot be used, {len(rows)} error{'s' if len(rows) > 1 else ''}:\n" + "\n".join(rows)
        ) from None


def unit_of(measure: str) -> str:
    """The SI unit of a measure; empty for one that is not known."""
    found = _MEASURES.get(measure.rpartition("/")[2])
    return found.unit if found else ""


def noun_of(measure: str) -> str:
    """A measure in a sentence: "apparent diameter"."""
    found = _MEASURES.get(measure.rpartition("/")[2])
    return found.noun if isinstance(found, crater_measures.Measure) else words_of(measure)


def words_of(measure: str) -> str:
    """A measure in words."""
    crater, _, name = measure.rpartition("/")
    words = _MEASURES[name].words if name in _MEASURES else name
    return f"{crater.replace('_', ' ')} {words}".strip()


def _observed(key: str, entry: Any, folder: Path) -> tuple[str, str, float, float, float]:
    """Name, unit, value and standard errors below and above it [SI] of what was observed."""
    name = key.removeprefix(FINAL)
    if name.rpartition("/")[2] not in _MEASURES:
        raise InputError(f"[inverse] observed: no measure {name!r}{nearest(name, list(_MEASURES))}")
    unit = unit_of(name)
    if isinstance(entry, str):
        value, minus, plus = _of_crater(name.rpartition("/")[2], entry, folder)
    else:
        value, minus, *rest = (_amount(key, one, unit) for one in entry)
        plus = rest[0] if rest else minus
    for error in (minus, plus):
        if not error > 0.0:
            raise InputError(f"[inverse] observed {key}: its standard error must be greater than 0 (given: {error:g})")
    if not value > 0.0:
        raise InputError(f"[inverse] observed {key}: logarithms are compared, so it must be greater than 0")
    return name, unit, value, minus, plus


def _of_crater(measure: str, crater: str, folder: Path) -> tuple[float, float, float]:
    """Value and errors of a measure of a crater of the catalogue, or of a file of the same form."""
    own = folder / crater
    found = observations.read(own) if crater.endswith(".toml") and own.is_file() else observations.load(crater)
    if measure not in found.values:
        raise InputError(f"[inverse] observed: {crater} has no {measure} (it has {', '.join(found.values)})")
    return found.values[measure]


def _amount(key: str, given: Any, unit: str) -> float:
    plain = unit in ("1", "")
    if plain != (not isinstance(given, str)):
        need = "a number without a unit" if plain else f"a text with a unit, in {unit}"
        raise InputError(f"[inverse] observed {key}: {given!r} must be {need}")
    try:
        return quantity.parse(given, unit) if isinstance(given, str) else float(given)
    except ValueError as reason:
        raise InputError(f"[inverse] observed {key}: {reason}") from None
