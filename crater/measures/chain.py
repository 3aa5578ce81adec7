"""The chain error: how far a measure moves by what a run chose without a reason, and what no single run can show.

One run knows how well its crater can be read off (``sigma_parts`` azimuth, resolution, datum, method). It does not
know how far the crater itself would be elsewhere with other draws of the random particles and grains, another
resolution, an earlier or later handoff, another alpha. Further runs measure that (``run_case CASE --errors``); for a
shipped case it stands in ``expected.toml``. It joins every error in quadrature as ``sigma_parts.chain``.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from matter.wording.crater_measures import COMPARED

if TYPE_CHECKING:
    from crater.measures.measure import Measures, Quantity
    from matter.case.body import Model

PART = "chain"
PARTS = {"draws": "random seeds", "size": "resolution", "handoff": "time of the handoff", "alpha": "alpha"}
"""Parts of the chain error and what each is, in words."""
OF_HANDOFF = ("handoff", "alpha")
"""Parts that only a run with a handoff has."""
UNKNOWN = "chain error not known: the errors cover the reading of this run only (run_case CASE --errors measures it)"
KNOWN = "errors include the chain error (sigma_parts.chain in measures.json)"


def missing(held: Collection[str], handed_over: bool) -> str:
    """Which parts of the chain error an error that holds the parts ``held`` leaves out, in words; empty where none.
    ``handed_over``: whether the run has a handoff."""
    left_out = [words for part, words in PARTS.items() if part not in held and (handed_over or part not in OF_HANDOFF)]
    return f"without {', '.join(left_out)}" if left_out else ""


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
    return replace(measures, quantities={name: without_error(one) for name, one in measures.quantities.items()})


def without_error(quantity: Quantity) -> Quantity:
    """A quantity of such a run."""
    return quantity if quantity.value is None or PART in quantity.parts else replace(quantity, sigma=None)


def _joined(quantity: Quantity, error: float) -> Quantity:
    return replace(
        quantity, sigma=float(np.hypot(quantity.sigma or 0.0, error)), parts={**quantity.parts, PART: error}
    )
