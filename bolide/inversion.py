"""From an observed crater to what made it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matter.errors import InputError

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Posterior:
    """What an inversion found; ``folder`` holds its files and page."""

    folder: Path
    verdict: str
    samples: pandas.DataFrame
    """Draws, each as likely as any other, a column for each parameter [SI; of "choices" the values]; ``attrs``:
    ``units``."""
    summary: pandas.DataFrame
    """A row for each parameter: mean, sd, quantiles (NaN of "choices"), width over that of the prior, whether it is
    identified [SI]."""
    _found: Any

    def __repr__(self) -> str:
        return f"<{self.verdict}>"

    @property
    def identified(self) -> list[str]:
        """The parameters that the data narrow to 0.9 of the prior's width, or less."""
        return list(self.summary.index[self.summary["identified"]])

    def predict(self, measure: str) -> pandas.Series:
        """Draws [SI] of a measure that the members have, observed or not, by the posterior. Raises ``InputError``."""
        import pandas

        from pipeline.inverse.inversion import unit_of

        drawn = pandas.Series(self._found.predicted(measure), name=measure)
        drawn.attrs["unit"] = unit_of(measure)
        return drawn

    def gains(self, error: float = 0.1) -> pandas.DataFrame:
        """How much narrower the posterior would be with a further measure: a row for each that the members have, its
        ``error`` as a fraction (of one that is observed already, half its error), and the expected width of each
        parameter over that of now. Raises ``InputError``."""
        import pandas

        from pipeline.inverse import expected_gain

        rows = [{"measure": one.measure, "error": one.error, **one.widths} for one in
                expected_gain.of_every(self._found, error)]  # fmt: skip
        return pandas.DataFrame(rows).set_index("measure")

    @property
    def directions(self) -> pandas.DataFrame:
        """Which directions of the priors the data can tell apart: singular value of the measures' slopes over their
        errors, width over the prior's along it, and the weight of each parameter."""
        import pandas

        made = self._found.directions
        table = pandas.DataFrame({"singular_value": made.singular, "width": made.widths})
        return table.join(pandas.DataFrame(made.vectors.T, columns=list(made.names)))

    def corner(self) -> Figure:
        """The corner plot, the prior in grey."""
        from matter.wording import drawing

        drawing.require("a picture")
        from pipeline.inverse import corner_picture

        return corner_picture.corner(self._found)


def invert(
    case: str | Path,
    preset: str | None = None,
    *,
    out: str | Path = "runs",
    **settings: Any,
) -> Posterior:
    """From the crater in ``[inverse]`` of a case, or of a file with ``[sweep]``, to what made it, as ``run_case CASE
    --invert`` does: nothing is run, the sweep's table is read. ``**{"inverse.model": "pi_scaling"}`` asks scaling laws
    instead.

    The files (``posterior.h5``, ``emulator.h5``, ``inverse.toml``, a page) are written into the folder of the answer.
    That folder given as ``case`` is the same answer again, without the runs and the case, and nothing is written.
    Raises ``InputError``.
    """
    from pipeline.case import read as cases
    from pipeline.case.overlay import toml
    from pipeline.inverse import emulator_file, inversion, result_files

    if (Path(case) / emulator_file.FILE).is_file():
        if preset or settings:
            raise InputError(f"{case} is an answer, and takes no other settings: ask the case again")
        return _posterior(emulator_file.read(Path(case)))
    overrides: Sequence[str] = [f"{key}={toml(value)}" for key, value in settings.items()]
    found = inversion.of_case(cases.read(Path(case), preset, overrides), Path(out))
    result_files.write(found)
    return _posterior(found)


def _posterior(found: Any) -> Posterior:
    import pandas

    from pipeline.inverse import result_files, verdict
    from pipeline.inverse.posterior import LEVELS

    units = dict(zip(found.design.names, found.design.units))
    samples = pandas.DataFrame(found.posterior.drawn(result_files.COUNT, found.seed), columns=list(units))
    for name, prior in found.priors.items():
        if prior.values:
            samples[name] = [prior.values[int(number)] for number in samples[name]]
    samples.attrs["units"] = units
    rows = [
        {"parameter": name, "unit": units[name], "mean": one.mean, "sd": one.sd,
         **{f"q{100.0 * level:g}": value for level, value in zip(LEVELS, one.quantiles)},
         "width": one.width, "identified": one.identified}
        for name, one in found.told.items()
    ]  # fmt: skip
    summary = pandas.DataFrame(rows).set_index("parameter")
    return Posterior(found.folder, verdict.sentence(found), samples, summary, found)
