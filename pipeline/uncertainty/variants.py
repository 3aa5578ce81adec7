"""The variants of a finished run that say how much its crater depends on the handoff, and the control runs
(``pipeline.uncertainty.sensitivity`` makes and compares them)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from matter.errors import InputError
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.running import going_on
from pipeline.running.request import Request
from pipeline.store import folder

FOLDER = "sensitivity"
CONTROLS = ("control_at_rest", "control_uncarved")
BED = "@bed"
"""Between the name of a variant and the number of its draw."""


@dataclass(frozen=True)
class Variant:
    """One change of the handoff of a run: ``overrides`` are texts of ``--set``; ``shared_stages`` are the stages that
    the run has done for it."""

    name: str
    overrides: tuple[str, ...]
    shared_stages: tuple[str, ...] = ("nbody", "sph", "bed")

    @property
    def origin(self) -> str:
        """The variant that this is a draw of: itself on the run's own bed."""
        return "base" if self.name.startswith("another_bed") else self.name.partition(BED)[0]

    def request(self, run: Path) -> Request:
        """The request that makes it. Raises ``InputError``."""
        return Request(going_on.read(run / "case.used.toml", None, self.overrides), run / FOLDER, start=None)


def variants(run: Path, draws: int = 1) -> list[Variant]:
    """The variants and controls of a finished run, each on ``draws`` beds, the run's own first. Raises ``InputError``
    when the run has no handoff or no ``case.used.toml``."""
    record = folder.record(stages.folder(run, "handoff") / "handoff.json")
    if not record or not (run / "case.used.toml").is_file():
        raise InputError(f"{run} is not a finished run: no handoff.json or no case.used.toml")
    seed = cases.read(run / "case.used.toml").document.get("bed", {}).get("seed", 1)
    time, limit, alpha = record["time_s"], record["speed_limit_m_s"], record["alpha_spacings"]

    def fixed(**changed: float) -> tuple[str, ...]:
        values = {"time": time, "speed_limit": limit, "alpha": alpha} | changed
        return (
            f'handoff.time="{values["time"]!r} s"',
            f'handoff.speed_limit="{values["speed_limit"]!r} m/s"',
            f"handoff.alpha={values['alpha']!r}",
        )

    every = [Variant("base", fixed())]
    every += [Variant(f"time_x{factor:g}", fixed(time=factor * time)) for factor in (0.5, 2.0)]
    every += [Variant(f"speed_limit_x{factor:g}", fixed(speed_limit=factor * limit)) for factor in (0.5, 2.0)]
    every += [Variant(f"alpha_x{factor:g}", fixed(alpha=factor * alpha)) for factor in (0.67, 1.5)]
    others = []
    for k in range(2, max(draws, 2) + 1):
        for one in every if k <= draws else every[:1]:
            name = ("another_bed" if k == 2 else f"another_bed_{k}") if one.name == "base" else f"{one.name}{BED}{k}"
            others.append(Variant(name, (*one.overrides, f"bed.seed={seed + k - 1}"), shared_stages=("nbody", "sph")))
    every += others
    return every + [
        Variant(f"control_{kind}", (*fixed(), f'handoff.control="{kind}"')) for kind in ("at_rest", "uncarved")
    ]
