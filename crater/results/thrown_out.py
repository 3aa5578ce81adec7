"""What the shock stage of a run threw out: catalogue, fates and origin, or why there are none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from crater.ejecta import catalogue as catalogues
from crater.ejecta import excavation, launch, size_classes
from crater.results.findings import Ejected, Setting
from crater.results.series import Moment
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles


def of_run(
    setting: Setting, ejected: Ejected, transient: Moment, growing: bool, shots: Sequence[Path], last: Particles
) -> tuple[Ejected, dict[str, str]]:
    """``ejected`` with its catalogue, fates and excavation as far as they are known, and reasons for what is not;
    ``transient`` is the crater at its largest volume, ``growing`` whether it still grew at the end, ``last`` the last
    snapshot of the shock stage."""
    radius = 0.5 * transient.value("diameter_apparent_m")
    if not radius > 0.0 or transient.measures is None:
        return ejected, {}
    crater, spacing = transient.measures.datum, float(last.attributes.get("spacing_at_impact_m", 0.0))
    try:
        frames = (snapshot.read(path, catalogues.FIELDS) for path in shots)
        above = launch.ABOVE * spacing
        found = catalogues.ejecta_catalogue(
            frames, setting.datum, setting.gravity, above, setting.settings.escape_speed
        )
        fates, sizes = catalogues.masses(found, crater, radius, last), size_classes.sizes(found, last)
        if sizes is not None:
            fates["size_classes_kg"] = size_classes.masses(found, sizes, crater, radius)
        if not setting.escape_known:  # "escapes 0 kg" would be a number that nobody knows
            for part in (fates["target_kg"], fates["projectile_kg"], *fates.get("size_classes_kg", {}).values()):
                del part[catalogues.ESCAPES]
        ejected = replace(ejected, catalogue=found, fates=fates, sizes=sizes)
        origin = excavation.facts(found, last, setting.datum, crater, radius, transient.time)
        if not setting.escape_known:
            origin["blanket"] = [part for part in origin["blanket"] if not part["escapes"]]
        return replace(ejected, excavation={**origin, "growing": growing}), {}
    except InputError as reason:
        return ejected, {"excavation": str(reason)}
