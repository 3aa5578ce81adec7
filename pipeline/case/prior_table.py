"""``[sweep.prior.NAME]``: the distribution of a quantity that a sweep draws.

    normal         mean, sd        p(x) ~ exp(-(x - mean)^2 / (2 sd^2))
    uniform        low, high       p(x) ~ 1 between the limits
    log_uniform    low, high       p(x) ~ 1 / x between the limits
    mixture        components      p(x) = sum of weight_k normal(mean_k, sd_k)
    choices        values          each as likely as any other

``low`` and ``high`` truncate a normal distribution and a mixture: p(x) = 0 outside, and larger by one factor inside.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, model_validator

from matter.case import quantity
from matter.case.body import Model

Number = bool | int | float | str
Amount = float | str
LEAST_PROBABILITY = 1e-6
"""What the limits must leave of a distribution."""
_ROUNDING = 1e-9

# the keys that a distribution needs, and those that it may have
_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "normal": (("mean", "sd"), ("low", "high")),
    "uniform": (("low", "high"), ()),
    "log_uniform": (("low", "high"), ()),
    "mixture": (("components",), ("low", "high")),
    "choices": (("values",), ()),
}


class Component(Model):
    """One of the normal distributions of a mixture."""

    weight: Annotated[float, Field(gt=0.0, le=1.0)]
    """Its fraction of the draws; those of all components add up to 1."""
    mean: Amount
    """Mean, before the mixture is truncated."""
    sd: Amount
    """Standard deviation, above zero."""


class Prior(Model):
    """The distribution of a quantity that a sweep draws. NAME is a key of the case in quotes,
    ``[sweep.prior."impact.speed"]``, or a name of one's own that ``[sweep.derive]`` takes up. Amounts are numbers, or
    texts with a unit."""

    distribution: Literal["normal", "uniform", "log_uniform", "mixture", "choices"]
    """``normal`` has mean and sd; ``uniform`` and ``log_uniform`` have low and high; ``mixture`` is the sum of normal
    ``components``; ``choices`` takes one of ``values``."""
    mean: Amount | None = None
    """Mean, before the distribution is truncated."""
    sd: Amount | None = None
    """Standard deviation, above zero."""
    low: Amount | None = None
    """Lower limit; it truncates ``normal`` and ``mixture``."""
    high: Amount | None = None
    """Upper limit; it truncates ``normal`` and ``mixture``."""
    components: tuple[Component, ...] = ()
    """The parts of a mixture, each with weight, mean and sd."""
    values: tuple[Number, ...] = ()
    """What ``choices`` takes one of, each as likely as any other: seeds, materials, any values of a key."""

    @property
    def normals(self) -> list[tuple[float, float, float]]:
        """Weight, mean and standard deviation [SI] of each normal distribution in it; empty where it has none."""
        si = self._si
        if self.distribution == "normal":
            return [(1.0, si["mean"], si["sd"])]
        return [
            (part.weight, si[f"components[{k}] mean"], si[f"components[{k}] sd"])
            for k, part in enumerate(self.components)
        ]

    @property
    def limits(self) -> tuple[float, float]:
        """Lower and upper limit [SI], infinite where there is none."""
        si = self._si
        return si.get("low", -math.inf), si.get("high", math.inf)

    @property
    def unit(self) -> str:
        """The unit in which the drawn values are written, that of the first amount; empty for numbers."""
        first = next(iter(self._amounts().values()), 0)
        return quantity.unit_in(first) if isinstance(first, str) else ""

    def _amounts(self) -> dict[str, Amount]:
        """Everything that was given as an amount, by what a message calls it."""
        own = {name: getattr(self, name) for name in ("mean", "sd", "low", "high")}
        parts = {
            f"components[{k}] {name}": getattr(part, name)
            for k, part in enumerate(self.components)
            for name in ("mean", "sd")
        }
        return {name: amount for name, amount in (own | parts).items() if amount is not None}

    @property
    def _si(self) -> dict[str, float]:
        return {
            name: quantity.parse(amount) if isinstance(amount, str) else float(amount)
            for name, amount in self._amounts().items()
        }

    @model_validator(mode="after")
    def _can_be_drawn(self) -> Prior:
        faults = [*self._wrong_keys(), *self._wrong_units()]
        if not faults:
            faults = list(self._wrong_values())
        if faults:
            raise ValueError("; ".join(faults))
        return self

    def _wrong_keys(self) -> Iterator[str]:
        needed, allowed = _KEYS[self.distribution]
        every = dict.fromkeys(name for keys in _KEYS.values() for name in (*keys[0], *keys[1]))
        given = [name for name in every if getattr(self, name) not in (None, ())]
        yield from (f"{name} is missing" for name in needed if name not in given)
        yield from (
            f"{self.distribution} takes no {name} (it takes {', '.join((*needed, *allowed))})"
            for name in given
            if name not in (*needed, *allowed)
        )

    def _wrong_units(self) -> Iterator[str]:
        units: dict[str, str] = {}
        for name, amount in self._amounts().items():
            try:
                units[name] = quantity.base_unit(amount) if isinstance(amount, str) else ""
            except ValueError as reason:
                yield f"{name}: {reason}"
            if not isinstance(amount, str) and not math.isfinite(amount):
                yield f"{name} is not a finite number"
        if len(set(units.values())) > 1:
            written = {name: quantity.unit_in(str(self._amounts()[name])) for name in units}
            shown = ", ".join(f"{name} in {unit or 'no unit'}" for name, unit in written.items())
            yield f"its amounts are not of one kind: {shown}"

    def _wrong_values(self) -> Iterator[str]:
        low, high = self.limits
        for name, amount in self._si.items():
            if name.endswith("sd") and not amount > 0.0:
                yield f"{name} must be greater than 0 (given: {self._amounts()[name]})"
        if not low < high:
            yield f"low must be less than high (given: {self.low} and {self.high})"
        if self.distribution == "log_uniform" and not low > 0.0:
            yield f"low must be greater than 0 where the logarithm is drawn (given: {self.low})"
        total = sum(part.weight for part in self.components)
        if self.components and abs(total - 1.0) > _ROUNDING:
            yield f"the weights of the components add up to {total:.6g}, not to 1"
        if low < high and all(sd > 0.0 for _, _, sd in self.normals) and self.normals:
            left = sum(weight * _probability(low, high, mean, sd) for weight, mean, sd in self.normals)
            if left < LEAST_PROBABILITY:
                yield f"low and high leave {left:.1g} of the distribution, less than {LEAST_PROBABILITY:g}"


def _probability(low: float, high: float, mean: float, sd: float) -> float:
    """That of a normal distribution between two limits, by the shorter one of its tails."""
    one, other = ((end - mean) / (math.sqrt(2.0) * sd) for end in (low, high))
    if one > 0.0:
        return 0.5 * (math.erfc(one) - math.erfc(other))
    return 0.5 * (math.erfc(-other) - math.erfc(-one))
