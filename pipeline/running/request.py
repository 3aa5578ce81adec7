"""What the user asked for: a case, which stages of it, where and how; and the settings that follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field as item
from functools import cached_property
from pathlib import Path

from matter.case.body import Model
from matter.errors import InputError
from pipeline.case import outside, stages
from pipeline.case.left_open import FROM_ENCOUNTERS
from pipeline.case.read import Case, with_impact
from pipeline.settings import sense
from pipeline.settings.checking import listed
from pipeline.settings.compose import compose, hash8


@dataclass(frozen=True)
class Request:
    """What the user asked for: a case, where, from and until which stage, recomputed or not, on how many threads."""

    case: Case
    out: Path = Path("runs")
    start: str | None = None
    until: str | None = None
    fresh: bool = False
    threads: int | None = None

    @cached_property
    def run_folder(self) -> Path:
        """Where the run is; raises ``InputError`` with every complaint about the case."""
        return self.case.run or self.out / f"{self.case.name}-{hash8(self.case)}"

    @property
    def wanted(self) -> tuple[str, ...]:
        """The stages to run; raises ``InputError`` for an unknown name or an empty range."""
        first = stages.ORDER.index(stages.known(self.start)) if self.start else 0
        last = stages.ORDER.index(stages.known(self.until)) if self.until else len(stages.ORDER) - 1
        if first > last:
            raise InputError(
                f"--from {self.start} comes after --until {self.until} (the order is {' '.join(stages.ORDER)})"
            )
        wanted = tuple(stage for stage in stages.ORDER[first : last + 1] if stage in self.case.stages)
        if not wanted:
            raise InputError(f"{self.case.file} has none of these stages: it has {' '.join(self.case.stages)}")
        return wanted

    def with_impact_of(self, nbody: Path) -> Case:
        """The case with the impact that the stage of the encounters has left in its folder. Raises ``InputError``."""
        case = with_impact(self.case, impact_of(nbody))
        if not case.pinned:
            raise InputError(
                f"{impact_of(nbody)} lacks {' or '.join(FROM_ENCOUNTERS)}: it does not say how the projectile hits"
            )
        return case


@dataclass
class Outcome:
    """A finished request: the run folder and what each unsound stage said."""

    run: Path
    unsound: dict[str, str] = item(default_factory=dict)


def settings_of(request: Request) -> dict[str, Model]:
    """The settings of the stages: from the case, and from the impact that an earlier run of the encounters has chosen.

    Raises ``InputError`` with every complaint about the case.
    """
    if "nbody" in request.wanted:
        return compose(request.case, request.wanted)
    if not request.case.pinned and not _impact_file(request).is_file():
        raise InputError(
            f"{request.case.file} takes speed and angle from the encounters, and {_impact_file(request)} does not "
            f"exist: run the stage nbody first"
        )
    return after_the_encounters(request)


def sensible(request: Request, settings: dict[str, Model]) -> list[str]:
    """Warnings about what the settings say together (``pipeline.settings.sense``). Raises ``InputError`` with
    everything that cannot be."""
    errors, warnings = sense.judged(settings, request.case.outside, request.wanted)
    if errors:
        raise InputError(listed(request.case, errors, ()))
    return warnings


def impact_of(nbody: Path) -> Path:
    """The file in which the stage of the encounters leaves the impact."""
    return nbody / outside.FILES["nbody"]


def _impact_file(request: Request) -> Path:
    return impact_of(stages.folder(request.run_folder, "nbody"))


def after_the_encounters(request: Request) -> dict[str, Model]:
    """The settings of the stages after the encounters, with the impact that these have left where they are done.

    Raises ``InputError`` with every complaint about the case.
    """
    nbody = stages.folder(request.run_folder, "nbody")
    return compose(request.with_impact_of(nbody) if impact_of(nbody).is_file() else request.case, request.wanted)
