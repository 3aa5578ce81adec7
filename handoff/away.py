"""What a handoff onto a whole body leaves besides the grains that go on.

* ``away.vtkhdf``: the ejecta that escape, orbit or come back after the run, and the whole blocks that escape, as the
  particles of the shock stage that they are (mass, position and velocity in the inertial frame of the run at the time
  of the handoff), with the table ``fate`` (``two_body.FATES``), so that a later stage can follow them. In
  ``start.vtkhdf`` they are grains of the state 2, which take no part.
* ``datum.ply``: the surface of the undisturbed body, along the axes of the bed.
* the attribute ``shot`` of the start: momentum of the projectile [kg m/s] and normal of the surface at the site, which
  beta counts against; ``turned``: the rotation (3, 3) of the body since the impact.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from handoff.domains import turning
from handoff.domains.whole_body import SURFACE_FILE, WholeBody
from handoff.settings import Settings
from handoff.source import two_body
from handoff.transfer.ejecta import BOOKED
from handoff.transfer.handed import Handoff
from matter.files import archive, snapshot
from matter.particles import Particles
from matter.solids import solid as solids

LIST_FILE = f"away{snapshot.SUFFIX}"


def leave(settings: Settings, handoff: Handoff, source: Particles, inputs: Path, out: Path) -> dict[str, Any]:
    """Write the files of a whole body into ``out``; the attributes of its start. Nothing of other ground.

    ``source`` is the snapshot as it stands in its file, ``inputs`` the run folder.
    """
    region = handoff.region
    if not isinstance(region, WholeBody):
        return {}
    fate = handoff.ejecta.fate
    escaping = fate != two_body.RETURNS
    blocks = _of_blocks(handoff, source)
    listed = source.select(np.concatenate([handoff.ejecta.source[escaping], blocks]))
    listed.attributes |= {"stage": "handoff", "fates": list(two_body.FATES)}
    listed.tables["fate"] = np.concatenate([fate[escaping], np.full(len(blocks), two_body.ESCAPES, dtype=fate.dtype)])
    snapshot.write(listed, out / LIST_FILE)
    with archive.replacing(out / SURFACE_FILE) as temporary:
        solids.surface_of(region.shape.solid).export(str(temporary), file_type="ply")
    shot = {"momentum_kg_m_s": momentum_of_projectile(settings, source, inputs).tolist()}
    return {
        "shot": shot | {"normal": region.shape.normal.tolist()},
        "turned": turning.turn(source, region).tolist(),
    }


def _of_blocks(handoff: Handoff, source: Particles) -> np.ndarray:
    """The particles (indices) of the whole blocks that escape."""
    if handoff.blocks is None:
        return np.zeros(0, dtype=np.int64)
    grains = handoff.blocks.grains
    return np.flatnonzero(np.isin(source.block, grains.block[grains.state == BOOKED]))


def momentum_of_projectile(settings: Settings, source: Particles, inputs: Path) -> np.ndarray:
    """Momentum (3,) [kg m/s] that the projectile brought: the shock stage's own figure, or, of a cloud from elsewhere,
    that of all its matter."""
    path, target, impact = inputs / "2_sph" / "stage_report.json", settings.target, settings.impact
    report = archive.read_json(path) if path.is_file() else {}
    size = (report.get("projectile") or {}).get("momentum_kg_m_s")
    if size is None or target is None or impact is None:
        return np.asarray(source.mass @ source.velocity)
    aim = np.array(target.aim(impact))
    return np.asarray(float(size) * aim / np.linalg.norm(aim))
