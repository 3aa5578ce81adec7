"""A run as an object: made or opened, its tables, snapshots, ledger and pictures."""

from __future__ import annotations

import json
import os
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from bolide import values
from bolide.plots import Plots
from bolide.values import Value
from matter.errors import InputError

if TYPE_CHECKING:
    import pandas
    import pyvista

    from matter.particles import Particles

_PROFILES = {
    "final": "profile.csv",
    "transient": "profile_transient.csv",
    "transient_at_maximum_depth": "profile_transient_depth.csv",
    "sph": "profile_sph.csv",
}
_HISTORIES = {"sph": "2_sph/history.csv", "dem": "5_dem/history.csv", "crater": "6_crater/time_series.csv"}
_FOLDERS = {"sph": "2_sph", "dem": "5_dem"}


@dataclass(frozen=True)
class Run:
    """A run folder. ``unsound``: what stages said that ended with a check of their own soundness failed, when it was
    made in this session."""

    folder: Path
    unsound: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"bolide.open({str(self.folder)!r})"

    @cached_property
    def measures(self) -> dict[str, dict[str, Value]]:
        """The measured craters: ``transient`` (at its largest volume), ``transient_at_maximum_depth``, ``final``, each
        with its measures by name (``depth_m``, ``diameter_apparent_m`` ...). Raises ``InputError`` where the crater
        was not measured."""
        content = self._json("6_crater/measures.json", "the crater was not measured")
        entries = {"transient": content.get("transient") or {}, "final": content.get("final") or {}}
        entries["transient_at_maximum_depth"] = entries["transient"].get("at_maximum_depth") or {}
        rows = {
            name: {key: value for key, cell in entry.items() if (value := values.of_entry(cell))}
            for name, entry in entries.items()
        }
        return {name: row for name, row in rows.items() if row}

    @cached_property
    def settings(self) -> dict[str, Any]:
        """Every value that was used, as the tables of ``case.used.toml``."""
        return tomllib.loads((self.folder / "case.used.toml").read_text())

    def profile(self, stage: str = "final") -> pandas.DataFrame:
        """The radial profile of a crater (``final``, ``transient``, ``transient_at_maximum_depth``, ``sph``):
        ``radius_m``, ``height_m``, its band over azimuth and the number of columns; ``attrs`` holds ``units`` and what
        the file says of itself. Raises ``InputError`` where there is none."""
        return self._table(f"6_crater/{_of(_PROFILES, stage, 'profile')}")

    def history(self, stage: str = "sph") -> pandas.DataFrame:
        """What a stage kept in time: ``sph`` and ``dem`` (energies, momenta), ``crater`` (the measures of every
        snapshot); ``attrs["units"]``. Raises ``InputError`` where there is none."""
        return self._table(_of(_HISTORIES, stage, "history"))

    @cached_property
    def snapshots(self) -> list[tuple[str, float, Path]]:
        """Stage, time [s] and file of every snapshot, in the order of time."""
        from matter.files import snapshot

        rows = [
            (stage, float(snapshot.attributes(path).get("time", 0.0)), path)
            for stage, name in _FOLDERS.items()
            for path in snapshot.series(self.folder / name)
        ]
        return sorted(rows, key=lambda one: one[1])

    def snapshot(
        self, time: float | str, stage: str | None = None, form: Literal["arrays", "pyvista"] = "arrays"
    ) -> Particles | pyvista.PolyData:
        """The snapshot nearest to a ``time`` after the impact ([s], or a text with unit), of one ``stage`` (``sph``,
        ``dem``) or of either: arrays by field (``particles.position``), or a pyvista mesh. Raises ``InputError`` where
        there is none."""
        from matter.files import snapshot

        moment = _si(time, "s", "time")
        there = [one for one in self.snapshots if stage in (None, one[0])]
        if not there:
            raise InputError(f"{self.folder} holds no snapshots{f' of {stage}' if stage else ''}")
        path = min(there, key=lambda one: abs(one[1] - moment))[2]
        self._whole(path)
        if form == "arrays":
            return snapshot.read(path)
        from matter.wording import drawing

        drawing.require("form='pyvista'", "pyvista")
        import pyvista

        mesh: Any = pyvista.read(path)
        return mesh

    @property
    def ledger(self) -> pandas.DataFrame:
        """The handoff's ledger, a row per criterion: value, limit, verdict, unit, note. Raises ``InputError`` where
        nothing was handed over."""
        import pandas

        rows = self._json("4_handoff/ledger.json", "nothing was handed over")
        return pandas.DataFrame(rows).set_index("name")

    def compare(self, *others: Run | str | Path, stage: str | None = None) -> pandas.DataFrame:
        """This run beside others, profiles (CSV) and observed craters (by name), like with like as
        ``compare_profiles`` does: a row per crater and measure."""
        import pandas

        from crater.comparison import craters
        from matter.wording.crater_measures import UNITS
        from pipeline.store import intact

        for other in (self, *others):
            intact.check_shown(other.folder if isinstance(other, Run) else Path(other), "crater")
        items = [craters.holdings(str(other.folder if isinstance(other, Run) else other)) for other in (self, *others)]
        chosen, said = craters.chosen(items, stage)
        rows = [
            {
                "crater": crater.label,
                "stage": crater.stage,
                "measure": name,
                "value": value,
                "minus": minus,
                "plus": plus,
                "unit": UNITS.get(name, ""),
            }
            for crater in chosen
            for name, (value, minus, plus) in crater.values.items()
        ]
        table = pandas.DataFrame(rows)
        table.attrs["chosen"] = said
        return table

    @property
    def plot(self) -> Plots:
        """Pictures: ``run.plot.profile()``."""
        return Plots(self.profile, self.folder.name)

    def _repr_html_(self) -> str:
        from matter.wording import page

        name, profile = self.folder.name, self.folder / "6_crater" / "profile.png"
        template = "bolide/templates/run.html.j2"
        return page.render(template, "shown", name=name, words=self._sentence(), profile=profile)

    def _sentence(self) -> str:
        """Diameter and depth of each measured crater."""
        try:
            measures = self.measures
        except InputError as reason:
            return str(reason)
        words = {"transient": "transient crater", "final": "final crater"}
        parts = []
        for name, noun in words.items():
            sizes = [
                f"{word} {measures[name][key]}"
                for key, word in (("diameter_apparent_m", "apparent diameter"), ("depth_m", "depth"))
                if key in measures.get(name, {})
            ]
            if sizes:
                parts.append(f"{noun}: {', '.join(sizes)}")
        return "; ".join(parts) or "no crater was found"

    def _json(self, name: str, else_words: str) -> Any:
        path = self.folder / name
        if not path.is_file():
            raise InputError(f"{self.folder}: {else_words} (no {name})")
        self._whole(path)
        try:
            return json.loads(path.read_text())
        except ValueError as reason:
            raise InputError(f"{path} is damaged, it is not valid JSON: {reason}") from None

    @staticmethod
    def _whole(path: Path) -> None:
        """Raise ``InputError`` where a file is not as its stage left it."""
        from pipeline.store import intact

        intact.check_file(path)

    def _table(self, name: str) -> pandas.DataFrame:
        import pandas

        path = self.folder / name
        if not path.is_file():
            raise InputError(f"{self.folder} holds no {name}")
        self._whole(path)
        try:
            table = pandas.read_csv(path, comment="#")
            text = path.read_text()
        except ValueError as reason:  # not a table, or not even text
            raise InputError(f"{path} is damaged, it is not a table: {reason}") from None
        lines = [line for line in text.splitlines() if line.startswith("#") and "=" in line]
        facts = [
            (key.strip(), value.strip()) for key, _, value in (line.lstrip("# ").partition("=") for line in lines)
        ]
        table.attrs = {**dict(facts), "units": {column: values.of_column(column) for column in table.columns}}
        return table


def _of(table: Mapping[str, str], name: str, what: str) -> str:
    if name not in table:
        raise InputError(f"no {what} {name!r} (there are {', '.join(table)})")
    return table[name]


def _si(value: float | str, unit: str, what: str) -> float:
    """A number in SI, or a text with a unit."""
    from matter.case import quantity

    try:
        return quantity.parse(value, unit) if isinstance(value, str) else float(value)
    except ValueError as reason:
        raise InputError(f"{what}: {reason}") from None


def open(folder: str | Path) -> Run:
    """The run in a folder. Raises ``InputError`` when it is none."""
    path = Path(folder)
    if not (path / "case.used.toml").is_file():
        raise InputError(f"{path} is not a run folder: it holds no case.used.toml")
    return Run(path)


def run(
    case: str | Path,
    preset: str | None = None,
    *,
    out: str | Path = "runs",
    size: str | None = None,
    start: str | None = None,
    until: str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    **settings: Any,
) -> Run:
    """Run or resume a case as ``run_case`` does, and open the run; a run folder as ``case`` goes on.

    ``settings`` are keys of the case with values in its form, ``**{"impact.speed": "15 km/s"}``; ``start`` and
    ``until`` name stages (``--from``, ``--until``); ``quiet``: nothing is printed.

    Raises ``InputError`` (bad input), ``Stopped`` (interrupted: the same call resumes), ``UnphysicalState``.
    """
    if threads is not None and "numba" not in sys.modules:
        os.environ["NUMBA_NUM_THREADS"] = str(threads)
    from pipeline.case.overlay import toml
    from pipeline.running import going_on, screen
    from pipeline.running.request import Request
    from pipeline.running.run import run as run_stages

    folder = Path(out)
    read = going_on.read(
        Path(case),
        preset,
        [f"{key}={toml(value)}" for key, value in settings.items()],
        folder if folder != Path("runs") else None,
        size,
    )
    display = screen.SilentScreen() if quiet else screen.screen()
    try:
        outcome = run_stages(Request(read, folder, start, until, threads=threads), display)
    finally:
        display.close()
    return Run(outcome.run, outcome.unsound)
