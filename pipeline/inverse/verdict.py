"""What an inversion says, in words."""

from __future__ import annotations

import math

import numpy as np

from matter.wording import readable
from pipeline.case.prior_table import Prior
from pipeline.inverse.design import WELL_EACH
from pipeline.inverse.directions import combination, sentences
from pipeline.inverse.expected_gain import Gain
from pipeline.inverse.inversion import Inversion, noun_of
from pipeline.inverse.posterior import ENOUGH, IDENTIFIED, LEVELS, Told

UNSEEN = 0.1
"""Singular value below which a direction is not named."""
_AT = {level: k for k, level in enumerate(LEVELS)}


def unit_of(unit: str) -> tuple[float, str]:
    """Factor and symbol for values of a parameter in the SI ``unit``: angles in degrees."""
    return (math.degrees(1.0), "°") if unit == "rad" else (1.0, "" if unit == "1" else readable.superscripts(unit))


def name_of(name: str) -> str:
    """The last part of a key, in words."""
    return name.rpartition(".")[2].replace("_", " ")


def amount(value: float, unit: str, digits: int = 2) -> str:
    """A value of a parameter with its unit."""
    factor, symbol = unit_of(unit)
    shown = readable.number(factor * float(f"{value:.{digits}g}") if factor == 1.0 else factor * value, digits)
    return f"{shown}{'' if symbol in ('', '°') else ' '}{symbol}"


def likeliest(prior: Prior, told: Told, part: float) -> str:
    """The likeliest of the values of "choices" that hold the fraction ``part`` of the posterior together, at least
    one: "sand (0.71), rock (0.22)"."""
    order = sorted(range(len(told.chances)), key=lambda number: -told.chances[number])
    held = np.cumsum([told.chances[number] for number in order])
    count = min(int(np.searchsorted(held, part)) + 1, len(order))
    return ", ".join(f"{prior.values[number]} ({told.chances[number]:.2g})" for number in order[:count])


def of_parameter(name: str, told: Told, unit: str, prior: Prior) -> str:
    """One parameter: "cohesion below 0.3 Pa (95 %)", "friction angle 28 ± 4°", "material sand (0.91)", or that it was
    not identified."""
    words, q = name_of(name), told.quantiles
    if not told.identified:
        return f"{words} not identified (its width is {told.width:.0%} of the prior's)".replace("%", " %")
    if told.chances:
        return f"{words} {likeliest(prior, told, 0.0)}"
    if told.bound:
        limit = q[_AT[0.95]] if told.bound == "below" else q[_AT[0.05]]
        return f"{words} {told.bound} {amount(limit, unit)} (95 %)"
    if prior.distribution == "log_uniform":
        ends = f"{amount(q[_AT[0.16]], unit)} to {amount(q[_AT[0.84]], unit)}"
        return f"{words} {amount(q[_AT[0.5]], unit)} ({ends})"
    factor, symbol = unit_of(unit)
    return f"{words} {readable.measured(factor * told.mean, factor * told.sd, symbol or '1')}"


def sentence(found: Inversion) -> str:
    """The answer in one line, the best known parameter first."""
    order = sorted(found.told, key=lambda name: found.told[name].width)
    units = dict(zip(found.design.names, found.design.units))
    said = [of_parameter(name, found.told[name], units[name], found.priors[name]) for name in order]
    return "; ".join(said)


def directions(found: Inversion) -> list[str]:
    """What the data can tell apart, whatever they say."""
    names = {name: name_of(name) for name in found.priors}
    return sentences(found.directions, [noun_of(one.name) for one in found.observed], names)


def direction_rows(found: Inversion) -> list[list[str]]:
    """A row for each direction: in words, singular value, width over the prior's; those that the data do not see in
    one."""
    names = {name: name_of(name) for name in found.priors}
    made = found.directions
    rows = [
        [combination(made, k, names), f"{value:.2f}", f"{width:.2f}"]
        for k, (value, width) in enumerate(zip(made.singular, made.widths))
        if value >= UNSEEN
    ]
    rest = len(made.names) - len(rows)
    return [*rows, [f"{rest} more", f"< {UNSEEN:g}", f"{made.widths[-rest:].max():.2f}"]] if rest else rows


def gain_rows(found: Inversion, gains: list[Gain]) -> list[list[str]]:
    """A row for each measure: which, its error, and the expected width of each parameter over that of now."""
    return [
        [f"{noun_of(one.measure)}{', half its error' if one.again else ''}", f"{one.error:.1%}",
         *(f"{min(one.widths[name], 1.0):.2f}" for name in found.priors)]
        for one in gains
    ]  # fmt: skip


def not_identified(found: Inversion) -> list[str]:
    """The parameters that the data do not narrow."""
    return [name for name, told in found.told.items() if not told.identified]


def cautions(found: Inversion) -> list[str]:
    """What weakens the answer, a sentence each."""
    said = []
    for one in found.observed:
        count, wanted = int(found.design.members_with(one.name).sum()), WELL_EACH * len(found.priors)
        if count < wanted:
            said.append(f"{count} members have {one.name}: {wanted} would be a good number.")
        z = found.emulator(one.name).left_out().z
        if abs(z).max() > 4.0 or z.std() > 1.5:
            said.append(
                f"The emulator of {one.name} is too sure of itself: left-out members lie {z.std():.1f} sigma off."
            )
        if one.discrepancy == 0.0:
            said.append(f"No discrepancy for {one.name}: the posterior is too narrow, since no model is perfect.")
        if abs(surprise(found, one.name)) > 3.0:
            said.append(f"The model does not reach {one.name} as it was observed: look at the priors.")
    if found.posterior.effective < 0.1 * ENOUGH:
        said.append(f"Only {found.posterior.effective:.0f} independent points carry the posterior.")
    if names := not_identified(found):
        said.append(
            f"Not identified (width over {IDENTIFIED:g} of the prior's): {', '.join(names)}. What is said of them is "
            f"mostly the prior."
        )
    return said


def surprise(found: Inversion, measure: str) -> float:
    """How many standard errors what was observed lies above what the posterior predicts, all errors together."""
    one = next(one for one in found.observed if one.name == measure)
    logarithm = np.log(found.predicted(measure))
    error = np.sqrt(logarithm.var() + one.error**2 + one.discrepancy**2)
    return float((np.log(one.value) - logarithm.mean()) / error)
