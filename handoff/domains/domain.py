"""The volume that a granular bed stands for: a cone of a sphere or an upright region of flat ground
(``matter.geometry.ground_region``), or the whole of a body of any shape (``handoff.domains.whole_body``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from handoff.domains import whole_body
from handoff.domains.whole_body import WholeBody
from matter.case.body import Target
from matter.errors import InputError
from matter.geometry.ground_region import Cone, Upright

Domain = Cone | Upright | WholeBody


def read(attributes: Mapping[str, Any], target: Target | None = None) -> Domain:
    """The domain of a bed from its snapshot's attributes: ``domain``, and ``frame``, ``sphere`` unless it says
    ``plane`` or ``solid``. A ``shape`` of flat ground that is not said is a cylinder; a whole body has the surface of
    the ``target``.

    Raises ``InputError`` naming what is missing, or when the numbers do not bound a volume.
    """
    frame, table = attributes.get("frame", "sphere"), attributes.get("domain")
    if frame == "solid":
        return whole_body.read(attributes, target)
    kind = Upright if frame == "plane" else Cone
    if not isinstance(table, Mapping):
        raise InputError(f"the bed carries no attribute 'domain': {', '.join(kind.GEOMETRY)}")
    return kind.of_attribute({"shape": "cylinder", **table}, kind.GEOMETRY)
