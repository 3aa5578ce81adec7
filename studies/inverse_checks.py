"""Checks of the inversion on laws with a known answer, contraction beside every coverage: the tables of
docs/results/inverse_scaling.

    python studies/inverse_checks.py      # half a minute

The law is that of Hayabusa2's crater (``fixtures.inverse_laws``), the runs are those of Raducan et al. 2019
(``fixtures.raducan_2019``). ``tests/pipeline/test_inversion.py`` holds the same figures to their limits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fixtures import inverse_laws as law
from fixtures import raducan_2019
from pipeline.case.prior_table import Prior
from pipeline.inverse import directions, posterior
from pipeline.inverse.emulator import Emulator, LeftOut
from pipeline.inverse.posterior import Observed

RUNS, POINTS, SCATTER = 48, 1 << 13, 0.04
_ERROR = 0.05
"""Of what is observed of a run that was left out."""


class Covered(NamedTuple):
    """``ranks`` (n, d) of the truths in their posteriors, ``widths`` (n, d) of these over the priors'."""

    ranks: np.ndarray
    widths: np.ndarray

    def within(self, part: float) -> np.ndarray:
        """Fraction of truths in the middle ``part`` of their posteriors, by parameter (d,)."""
        return np.asarray(np.mean(np.abs(self.ranks - 0.5) < 0.5 * part, axis=0))

    @property
    def contraction(self) -> np.ndarray:
        """Mean width over the prior's, by parameter (d,)."""
        return np.asarray(self.widths.mean(axis=0))


def emulated(seed: int, noise: float = 0.0, runs: int = RUNS) -> tuple[Emulator, np.ndarray, np.ndarray]:
    """The law emulated from so many runs, their parameters (n, d) [SI] and ln of their diameters (n,)."""
    theta = posterior.prior_draws(law.PRIORS, runs, seed)
    y = law.log_diameter(theta) + noise * np.random.default_rng(seed).standard_normal(runs)
    return Emulator(posterior.all_coordinates(law.PRIORS, theta), y, np.full(runs, noise**2)), theta, y


def covered(
    priors: Mapping[str, Prior], points: np.ndarray, mean: np.ndarray, sd: np.ndarray, truth: np.ndarray,
    observed: Sequence[Observed],
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Ranks and widths (d,) of one ``truth`` (d,) in the posterior by what is ``observed`` of it, from ``points`` of
    the priors at which a model says ``mean`` and ``sd`` (n, m)."""
    weight = posterior.weighted(tuple(priors), points, posterior.log_likelihood(observed, mean, sd)).weight
    widths = [
        float(posterior.spread(prior, points[:, k], weight)) / posterior.prior_spread(prior)
        for k, prior in enumerate(priors.values())
    ]
    return weight @ (points < truth), np.array(widths)


def second_design() -> tuple[np.ndarray, Covered]:
    """Of two independent designs with 4 % scatter: whether each member of one lies within one standard error of what
    the other predicts (96,), and its parameters among their posteriors by the other."""
    points = posterior.prior_draws(law.PRIORS, POINTS, 3)
    inside: list[bool] = []
    pairs = []
    designs = [emulated(seed, SCATTER) for seed in (5, 6)]
    for (made, _, _), (_, theta, y) in (designs, designs[::-1]):
        mean, sd = made.predict(posterior.all_coordinates(law.PRIORS, theta))
        inside += list(np.abs(y - mean) < np.hypot(sd, SCATTER))
        at = [column[:, None] for column in made.predict(posterior.all_coordinates(law.PRIORS, points))]
        for truth, size in zip(theta, np.exp(y)):
            observed = law.observed(size, 0.02 * size, SCATTER)
            pairs.append(covered(law.PRIORS, points, at[0], at[1], truth, observed))
    return np.array(inside), Covered(*map(np.array, zip(*pairs)))


def left_out() -> Covered:
    """Ten members of a design without scatter, each observed to 5 %, by an emulator of 48 others."""
    theta = posterior.prior_draws(law.PRIORS, RUNS + 10, 7)
    y = law.log_diameter(theta)
    x = posterior.all_coordinates(law.PRIORS, theta)
    made = Emulator(x[10:], y[10:], np.zeros(RUNS))
    points = posterior.prior_draws(law.PRIORS, POINTS, 3)
    mean, sd = (column[:, None] for column in made.predict(posterior.all_coordinates(law.PRIORS, points)))
    pairs = [
        covered(law.PRIORS, points, mean, sd, truth, law.observed(size, _ERROR * size, 0.0, 0.02))
        for truth, size in zip(theta[:10], np.exp(y[:10]))
    ]
    return Covered(*map(np.array, zip(*pairs)))


def discrepancies() -> dict[float, dict[str, posterior.Told]]:
    """What Ryugu's crater says by the law with a discrepancy of 0, 8 and 16 %."""
    return {
        scale: posterior.told(
            law.PRIORS, posterior.sampled(law.PRIORS, law.exactly, law.observed(discrepancy=scale))
        )
        for scale in (0.0, 0.08, 0.16)
    }  # fmt: skip


class Runs(NamedTuple):
    """Runs of another code: leave-one-out of the emulators, the runs among posteriors by the others, and which
    directions both measures tell apart."""

    members: list[LeftOut]
    covered: Covered
    directions: directions.Directions


def another_code() -> Runs:
    """The runs of Raducan et al. 2019, each left out in turn and observed to 5 % (with an error drawn)."""
    theta, y = raducan_2019.runs()
    priors = raducan_2019.PRIORS
    x, points = posterior.all_coordinates(priors, theta), posterior.prior_draws(priors, POINTS, 3)
    at = posterior.all_coordinates(priors, points)
    known = ~np.isnan(y)
    whole = [Emulator(x[there], y[there, k], np.zeros(there.sum())) for k, there in enumerate(known.T)]
    rng, pairs = np.random.default_rng(2), []
    for run in np.flatnonzero(known.all(axis=1)):
        seen = np.exp(y[run] + _ERROR * rng.standard_normal(2))
        observed = [
            Observed(name, "1", size, _ERROR * size, _ERROR * size, 0.0, 0.0) for name, size in zip("bm", seen)
        ]
        columns = []
        for k, made in enumerate(whole):
            rest = known[:, k] & (np.arange(len(x)) != run)
            again = Emulator(x[rest], y[rest, k], np.zeros(rest.sum()), kernel=made.kernel)
            columns.append(again.predict(at))
        mean, sd = (np.stack([column[part] for column in columns], axis=1) for part in (0, 1))
        pairs.append(covered(priors, points, mean, sd, theta[run], observed))

    def predict(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        both = [made.predict(posterior.all_coordinates(priors, values)) for made in whole]
        return np.stack([one[0] for one in both], axis=1), np.stack([one[1] for one in both], axis=1)

    usual = [Observed(name, "1", 1.0, _ERROR, _ERROR, 0.0, 0.0) for name in "bm"]
    found = directions.told_apart(priors, predict, usual)
    return Runs([made.left_out() for made in whole], Covered(*map(np.array, zip(*pairs))), found)


def main() -> None:
    """Print the tables."""
    print("| discrepancy | friction angle | cohesion, 95 % | density | width over prior's |\n|---|---|---|---|---|")
    for scale, told in discrepancies().items():
        angle, cohesion, density = told.values()
        widths = ", ".join(f"{one.width:.2f}" for one in told.values())
        below = cohesion.quantiles[posterior.LEVELS.index(0.95)]
        cells = [f"{np.degrees(angle.mean):.1f} ± {np.degrees(angle.sd):.1f}°", f"below {below:.2f} Pa"]
        print(f"| {scale:.0%} |", " | ".join([*cells, f"{density.mean:,.0f} ± {density.sd:.0f} kg/m³", widths]), "|")
    inside, second = second_design()
    print(f"\nsecond design: predicted {inside.mean():.3f} of {len(inside)}")
    other = another_code()
    for words, one in (("second design", second), ("left out", left_out()), ("another code", other.covered)):
        print(words, len(one.ranks), "68 %:", one.within(0.68), "95 %:", one.within(0.95), "width:", one.contraction)
    for name, members in zip(("beta - 1", "mass"), other.members):
        z, count = members.z, len(members.z)
        print(f"{name}: {count} runs, rms {members.rms:.3f}, z {z.mean():+.2f}, {z.std():.2f}, to {abs(z).max():.1f}")
    names = {name: name for name in raducan_2019.PRIORS}
    print(other.directions.singular, other.directions.widths, *other.directions.vectors.T.round(2).tolist())
    print(*directions.sentences(other.directions, ["beta - 1", "mass"], names), sep="\n")


if __name__ == "__main__":
    main()
