"""The chain error: how far a measure moves by what a run chose without a reason, and what no single run can show.

One run knows how well its crater can be read off (``sigma_parts`` azimuth, resolution, datum, method). It does not know how far the crater itself would be
elsewhere with other draws of the random particles and grains, a coarser size, an earlier or later handoff. That is measured once for a shipped case
(``studies/chain_error.py``), stands in the case's ``expected.toml``, and joins every error in quadrature as ``sigma_parts.chain``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from crater.measure import Measures, Quantity
from matter.body import Model
from matter.quantity import Length, Volume

if TYPE_CHECKING:
    from crater.findings import Findings

PART = "chain"
UNKNOWN = "chain error not known: the errors hold what this one run shows, not other draws of particles and grains, another size or another time of the handoff"
KNOWN = "errors include the chain error (sigma_parts.chain in measures.json: other draws of particles and grains, another size, another time of the handoff)"
_Error = Annotated[Length, Field(ge=0)]


class Errors(Model):
    """The chain error of each measure of one crater; a measure that is left out has none that is known."""

    diameter_apparent_m: _Error | None = None
    """Of the apparent diameter."""
    diameter_rim_m: _Error | None = None
    """Of the rim-to-rim diameter."""
    depth_m: _Error | None = None
    """Of the depth below the datum."""
    depth_rim_to_floor_m: _Error | None = None
    """Of the depth from rim to floor."""
    rim_height_m: _Error | None = None
    """Of the rim's height."""
    volume_m3: Annotated[Volume, Field(ge=0)] | None = None
    """Of the volume below the datum."""


MEASURES = tuple(Errors.model_fields)


class ChainError(Model):
    """Chain errors of the transient crater, at its largest volume and where it is deepest, and of the final one."""

    transient: Errors = Errors()
    """Of the transient crater at its largest volume."""
    transient_at_maximum_depth: Errors = Errors()
    """Of the transient crater where it is deepest."""
    final: Errors = Errors()
    """Of the final crater."""


CRATERS = tuple(ChainError.model_fields)


def with_chain(measures: Measures, errors: Errors) -> Measures:
    """The measures with the chain error in quadrature, as a part of its own; a measure without a value stays as it is."""
    return with_errors(measures, {name: error for name in MEASURES if (error := getattr(errors, name)) is not None})


def with_errors(measures: Measures, errors: Mapping[str, float]) -> Measures:
    """``with_chain`` for errors by measure [SI]."""
    quantities = dict(measures.quantities)
    for name, error in errors.items():
        found = quantities.get(name)
        if found is not None and found.value is not None:
            quantities[name] = _joined(found, error)
    return replace(measures, quantities=quantities)


def _joined(found: Quantity, error: float) -> Quantity:
    return replace(found, sigma=float(np.hypot(found.sigma or 0.0, error)), parts={**found.parts, PART: error})


def enter(found: Findings) -> None:
    """Give the measured craters of a run their chain errors, where its settings carry them; the all-SPH late stage has none."""
    known = found.settings.chain
    if known is None:
        return
    for key, moment in found.transient.items():
        errors = known.transient_at_maximum_depth if key == "depth" else known.transient
        if moment.measures is not None:
            found.transient[key] = replace(moment, measures=with_chain(moment.measures, errors))
    if found.final is not None and found.final is not found.late_sph:
        found.final = with_chain(found.final, known.final)
