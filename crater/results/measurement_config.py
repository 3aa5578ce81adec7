"""Configuration of a crater measurement: the datum, the ground before the impact, the limit of what counts as in
flight, the search radius. One crater measured twice with the same configuration gives the same numbers; the stage
keeps its own in ``measures.json``, and every snapshot of a run carries enough to reproduce it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from crater.bodies.on_curved_ground import on_body
from crater.ground import datum as datums
from crater.ground import locate
from crater.ground.datum import Datum
from crater.ground.surface import Undisturbed
from crater.measures.measure import Measures, measure
from crater.settings import RISE_LIMIT
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.particles import Particles
from matter.solids.tangent_map import TangentMap
from matter.wording import readable

REACH, WITHIN = 2.5, 0.5
"""In expected transient diameters: how far the columns of a whole body go, and how far from the axis the crater is
looked for. The far field of the crater is wanted, not the far side of the body."""
ON_A_BODY = (
    "a crater on an ellipsoid or mesh is measured by its run alone (6_crater/measures.json): a snapshot does not hold "
    "the surface of before"
)
ATTRIBUTE = "measuring"
"""Attribute of a snapshot that holds its datum, gravity, expected crater and ground before the impact."""


@dataclass(frozen=True)
class MeasurementConfig:
    """``before``: snapshot of the undisturbed ground; ``gravity`` [m/s^2], ``rise_limit`` [m], ``reach`` [m] (None: as
    far as the cloud goes), ``within`` [m].

    ``unknown``: inputs of the run's own measurement that are missing here, in words.
    """

    datum: Datum
    before: Path | None
    gravity: float
    rise_limit: float
    reach: float | None
    within: float
    sectors: int = 24
    seed: int = 1
    unknown: tuple[str, ...] = field(default=())
    chain: Mapping[str, float] = field(default_factory=dict)
    """Chain errors (``crater.chain``) that the run gives the crater in this very snapshot, by measure [SI]."""
    ground: TangentMap | None = None
    """The ground of an ellipsoid or mesh, which is laid flat before it is measured."""

    def seen(self, particles: Particles) -> Particles:
        """A snapshot as it is measured. Raises ``InputError`` where too little of a body is left."""
        return particles if self.ground is None else self.ground.flattened(particles)

    def ground_before(self) -> Undisturbed | None:
        """The ground before the impact, measured; None where it is not at hand."""
        if self.before is None or not self.before.is_file():
            return None
        particles = self.seen(snapshot.read(self.before))
        return locate.ground_before(particles, self.datum, self.reach, self.sectors)

    def measured(self, particles: Particles, before: Undisturbed | None, what: str) -> Measures:
        """Measure ``particles``, with the ground ``before`` as ``ground_before`` gave it. Raises
        ``InputError`` as ``measure``."""
        return self.told(measure(self.seen(particles), self.datum, before, self.search, what=what))

    def told(self, measures: Measures) -> Measures:
        """Measures as they are on the body, of ground that was laid flat."""
        return measures if self.ground is None else on_body(self.ground, measures)

    @property
    def search(self) -> locate.Search:
        """How the ground is looked at."""
        return locate.Search(self.gravity, self.rise_limit, self.reach, self.within, self.sectors, self.seed)

    def as_dict(self, run: Path) -> dict[str, Any]:
        """JSON-ready; ``before`` relative to the ``run`` folder."""
        before = None if self.before is None else self.before.relative_to(run).as_posix()
        return {
            "datum": datum_facts(self.datum), "before": before, "gravity_m_s2": self.gravity,
            "rise_limit_m": self.rise_limit,
            "reach_m": self.reach, "within_m": self.within, "sectors": self.sectors, "seed": self.seed,
            **({} if self.ground is None else {"flattened_about": self.ground.site.tolist()}),
        }  # fmt: skip

    def words(self) -> str:
        """The configuration as one line of text."""
        ground = "heights over the bare datum"
        if self.before is not None:
            ground = f"heights against the ground before the impact ({self.before.parent.name}/{self.before.name})"
        flying = f"what would rise above {readable.length(self.rise_limit)} is in flight"
        return (
            f"{ground}; {flying}; looked for within {readable.length(self.within)} of the axis; {self.sectors} "
            f"sectors, seed {self.seed}"
        )


def datum_facts(datum: Datum) -> dict[str, Any]:
    """A datum as plain numbers."""
    return {
        "kind": datum.kind, "radius_m": datum.radius if datum.is_sphere else None, "centre_m": list(datum.centre),
        "axes": [list(row) for row in datum.axes], "source": datum.source,
    }  # fmt: skip


def datum_of(facts: Mapping[str, Any]) -> Datum:
    """The datum behind ``datum_facts``."""
    if facts["kind"] == "sphere":
        datum = datums.sphere(
            float(facts["radius_m"]), tuple(facts["centre_m"]), source=str(facts.get("source", "given"))
        )
    else:
        x, y, z = (float(c) for c in facts["centre_m"])
        datum = datums.plane(z, (x, y), source=str(facts.get("source", "given")))
    if "axes" not in facts:
        return datum
    first, second, third = (tuple(float(c) for c in row) for row in facts["axes"])
    return replace(datum, axes=(first, second, third))  # type: ignore[arg-type]


def of_snapshot(path: Path, attributes: Mapping[str, Any]) -> MeasurementConfig | None:
    """The configuration for a snapshot: that of the run that it lies in, else the one it carries; None for a snapshot
    that says nothing of the kind. Raises ``InputError`` for one of an ellipsoid or mesh."""
    path = Path(path)
    if attributes.get("frame") == "solid":
        raise InputError(f"{path}: {ON_A_BODY}")
    stage = str(attributes.get("stage", ""))
    return _of_run(path, stage) or _of_attributes(path, attributes)


def _of_run(path: Path, stage: str) -> MeasurementConfig | None:
    """What the run's own crater stage chose for its snapshots of a stage, where it has run."""
    run = path.parent.parent
    file = run / "6_crater" / "measures.json"
    measures = archive.read_json(file) if file.is_file() else {}
    facts = measures.get("measured_with", {}).get(stage)
    if not facts:
        return None
    before = run / facts["before"] if facts["before"] else None
    missing = () if before is None or before.is_file() else (f"the ground before the impact ({facts['before']})",)
    return MeasurementConfig(
        datum_of(facts["datum"]), before if not missing else None, float(facts["gravity_m_s2"]),
        float(facts["rise_limit_m"]), facts["reach_m"],
        float(facts["within_m"]), int(facts["sectors"]), int(facts["seed"]), missing,
        _chain_of(measures, f"{path.parent.name}/{path.name}"),
    )  # fmt: skip


def _chain_of(measures: Mapping[str, Any], name: str) -> dict[str, float]:
    """Chain errors of the crater that the run measured in its snapshot ``name``: at the largest volume or final before
    any other moment."""
    transient = measures.get("transient", {})
    for entry in (
        measures.get("final", {}),
        transient,
        *(transient.get(f"at_maximum_{key}", {}) for key in ("depth", "diameter")),
    ):
        if entry.get("snapshot") == name:
            parts = {
                key: (cell.get("sigma_parts") or {}).get("chain")
                for key, cell in entry.items()
                if isinstance(cell, Mapping) and "sigma" in cell
            }
            return {key: float(error) for key, error in parts.items() if error}
    return {}


def _of_attributes(path: Path, attributes: Mapping[str, Any]) -> MeasurementConfig | None:
    """What the snapshot itself carries, with the stage's defaults for the rest."""
    carried = attributes.get(ATTRIBUTE)
    if not isinstance(carried, Mapping):
        return None
    size = float(carried["expected_transient_diameter_m"])
    # by names: a run's stages may be links to where they lie
    before = Path(os.path.normpath(path.parent / str(carried["before"])))
    missing = () if before.is_file() else (f"the ground before the impact ({carried['before']} beside it)",)
    whole = attributes.get("stage") == "sph"
    return MeasurementConfig(
        datum_of(carried["datum"]), before if not missing else None, float(carried["gravity_m_s2"]), RISE_LIMIT * size,
        REACH * size if whole else None,
        WITHIN * size, unknown=missing,
    )  # fmt: skip
