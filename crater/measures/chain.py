"""The chain error: how far a measure moves by what a run chose without a reason, and what no single run can show.

One run knows how well its crater can be read off (``sigma_parts`` azimuth, resolution, datum, method). It does not
know how far the crater itself would be elsewhere with other draws of the random particles and grains, a coarser size,
an earlier or later handoff. That is measured once for a shipped case (``studies/chain_error.py``), stands in the
case's ``expected.toml``, and joins every error in quadrature as ``sigma_parts.chain``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from crater.measures.measure import Measures, Quantity
from matter.case.body import Model
from matter.wording.crater_measures import COMPARED

PART = "chain"
UNKNOWN = "chain error not known: the errors cover this run only, not random seed, resolution or handoff time"
KNOWN = (
    "errors include the chain error (sigma_parts.chain in measures.json: other draws of particles and grains, another "
    "size, another time of the handoff)"
)


def with_chain(measures: Measures, errors: Model) -> Measures:
    """The measures with the chain error in quadrature, as a part of its own; a measure without a value stays as it
    is."""
    return with_errors(measures, {name: error for name in COMPARED if (error := getattr(errors, name)) is not None})


def with_errors(measures: Measures, errors: Mapping[str, float]) -> Measures:
    """``with_chain`` for errors by measure [SI]."""
    quantities = dict(measures.quantities)
    for name, error in errors.items():
        quantity = quantities.get(name)
        if quantity is not None and quantity.value is not None:
            quantities[name] = _joined(quantity, error)
    return replace(measures, quantities=quantities)


def without_errors(measures: Measures) -> Measures:
    """The measures of a run that is not resolved: those without a chain error, which holds another size, have no
    error."""
    quantities = {
        name: quantity if quantity.value is None or PART in quantity.parts else replace(quantity, sigma=None)
        for name, quantity in measures.quantities.items()
    }
    return replace(measures, quantities=quantities)


def _joined(quantity: Quantity, error: float) -> Quantity:
    return replace(
        quantity, sigma=float(np.hypot(quantity.sigma or 0.0, error)), parts={**quantity.parts, PART: error}
    )
