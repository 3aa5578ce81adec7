"""Balls dropped onto beads, by the grains alone, against experiments: depth, duration and width over height, density
and gravity.

    python studies/drops.py [--out docs/results/drops] [--work runs/drops]

Set-up and limits (``CLAIMS``) were committed before the first run; none is fitted to it. A bed of some 17,000 beads in
a cylinder 5.1 balls wide and 2.1 deep, one a seed; eleven drops. Beds are kept in ``--work``, drops in ``drops.json``,
so the script goes on with the drop at which it was stopped. It prints the table of verdicts; from the fifth drop on it
writes ``verdicts.json`` and ``drops.png`` from the drops that are done. ``first.json`` holds the verdicts of the first
complete run, and is never written again.
"""

from __future__ import annotations

import argparse
import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dem.trials import friction_angle
from matter.particles import Particles
from studies.dem_bulk import Kept
from studies.granular import dropped_ball, verdicts
from studies.granular.dropped_ball import BEADS, Ball, Fall
from studies.granular.verdicts import Claim, Found

RADIUS, HEIGHT, DIAMETER = 18.0, 15.0, 7.0
"""Of the cylinder, of its filling, and of the ball [d]."""
ALUMINIUM, WOOD, STEEL = 1.08, 0.28, 3.12
"""Densities 2.7, 0.7, 7.8 over 2.5 g/cm^3 of glass."""
HEIGHTS = (0.0, 0.1, 0.4, 1.6, 6.4)
"""Of the release over the ball's diameter: from 0 to 3.6 sqrt(g D)."""
MIDDLE, LOW, SEEDS, WEAKER = 1.6, 0.4, (1, 2, 3), 10.0
"""The height at which three beds tell the scatter, that of the densities, and the ground's weight over a lower one:
g = 9.81 and 0.981 m/s^2."""


class Drop(NamedTuple):
    """One drop of the plan: a ball's density and height, the bed's seed, k_n over that of the bed."""

    density: float
    height: float
    seed: int = 1
    springs: float = 1.0

    @property
    def name(self) -> str:
        return f"density {self.density:g}, height {self.height:g}, seed {self.seed}, springs {self.springs:g}"


PLAN = (
    *(Drop(ALUMINIUM, height) for height in HEIGHTS),
    *(Drop(density, LOW) for density in (WOOD, STEEL)),
    *(Drop(ALUMINIUM, height, springs=WEAKER) for height in (LOW, MIDDLE)),
    *(Drop(ALUMINIUM, MIDDLE, seed) for seed in SEEDS[1:]),
)


CLAIMS = {
    "V23": Claim("depth over the total drop H = h + d: exponent", 1.0 / 3.0, 0.05),
    "V24": Claim("depth over that of the law (0.14/mu) (rho_b/rho_g)^1/2 D^2/3 H^1/3, mean of five", 1.0, 0.20),
    "V25": Claim("depth over H^1/3 against the ball's density: exponent", 0.5, 0.10),
    "V26": Claim("width of the hollow over energy m g H: exponent", 0.25, 0.05),
    "V27": Claim("duration from 0.45 to 3.6 sqrt(g D): longest over shortest, less 1", 0.0, 0.20),
    "V28": Claim("depth over speed, the same range: largest distance from a line, over the depth of the fastest", 0.0,
                 0.05),
    "V29": Claim("rebound of any drop, over the ball's diameter", 0.0, 0.02),
    "V30": Claim("a tenth of the gravity at equal v^2/(g D): largest change of depth and duration", 0.0, 0.10),
    "V31": Claim("depths by one m v^2/d_1 + k z fitted to all five ways down: largest error", 0.0, 0.10),
}  # fmt: skip
"""What the limits mean: over a range of 20 in H an exponent off by 0.05 is 16 % between its ends, over one of 11 in
density 0.10 is 27 %; mu of the law is of an angle of repose in the source, of steady shear here, which may be 20 %
apart; the others are what the sources' words ("linear", "independent", "no rebounds") are taken to mean beside a ball
of seven beads."""


def bed_of(seed: int, work: Path) -> Particles:
    """The bed of a seed, settled when it is not there."""
    return dropped_ball.settled(seed, RADIUS, HEIGHT, work / f"loose_{seed}")


class Ground(NamedTuple):
    """Of the beads: slope angle of steady shear [deg] and its error; of the bed of the first seed how many they are,
    its solid fraction, density over that of a bead, and level [d]."""

    angle_deg: float
    error_deg: float
    beads: int
    fraction: float
    density: float
    level: float


def ground_of(work: Path) -> Ground:
    """What the laws need to know of the ground; nothing of it comes from a drop."""
    angle, bed = friction_angle.measure(BEADS), bed_of(SEEDS[0], work)
    solid, density = dropped_ball.bulk(bed)
    return Ground(angle["angle_deg"], angle["error_deg"], len(bed), solid, density, dropped_ball.level(bed))


def judged(falls: dict[Drop, Fall], ground: Ground) -> dict[str, Found]:
    """The verdicts that these drops allow; of a claim whose drops are not complete there is none."""
    beds = [falls[drop] for drop in (Drop(ALUMINIUM, MIDDLE, seed) for seed in SEEDS) if drop in falls]
    scatter = {name: verdicts.scatter([getattr(one, name) for one in beds]) for name in ("depth", "width", "duration")}
    found = {}
    for name, measure in MEASURES.items():
        try:
            value, error = measure(falls, ground, scatter)
        except KeyError:
            continue
        found[name] = verdicts.judged(CLAIMS[name], value, error)
    return found


Falls = dict[Drop, Fall]
Scatter = dict[str, float]


def _heights(falls: Falls) -> list[Fall]:
    return [falls[Drop(ALUMINIUM, height)] for height in HEIGHTS]


def _over_total(falls: Falls, scatter: Scatter, name: str) -> tuple[float, float]:
    """Exponent of a length over H."""
    main = _heights(falls)
    total = [one.height + one.depth for one in main]
    return verdicts.exponent(total, [getattr(one, name) for one in main]), scatter[name] / verdicts.spread(total)


def _over_law(falls: Falls, ground: Ground, scatter: Scatter) -> tuple[float, float]:
    main, mu = _heights(falls), math.tan(math.radians(ground.angle_deg))
    law = [dropped_ball.depth_by_law(mu, ALUMINIUM / ground.density, one.height) for one in main]
    over = float(np.mean([one.depth / depth for one, depth in zip(main, law, strict=True)]))
    of_mu = math.radians(ground.error_deg) * (1.0 + mu**2) / mu
    return over, over * math.hypot(scatter["depth"] / math.sqrt(len(main)), of_mu)


def _over_density(falls: Falls, ground: Ground, scatter: Scatter) -> tuple[float, float]:
    densities = (WOOD, ALUMINIUM, STEEL)
    other = [falls[Drop(density, LOW)] for density in densities]
    parts = [one.depth / (one.height + one.depth) ** (1.0 / 3.0) for one in other]
    return verdicts.exponent(densities, parts), scatter["depth"] / verdicts.spread(densities)


def _duration(falls: Falls, ground: Ground, scatter: Scatter) -> tuple[float, float]:
    times = [one.duration for one in _heights(falls)[1:]]
    return max(times) / min(times) - 1.0, math.sqrt(2.0) * scatter["duration"]


def _straight(falls: Falls, ground: Ground, scatter: Scatter) -> tuple[float, float]:
    fast = _heights(falls)[1:]
    return dropped_ball.bend([one.froude for one in fast], [one.depth for one in fast]), scatter["depth"]


def _rebound(falls: Falls, ground: Ground, scatter: Scatter) -> tuple[float, float]:
    return max(one.deepest - one.depth for one in falls.values()), math.nan


def _weaker(falls: Falls, ground: Ground, scatter: Scatter) -> tuple[float, float]:
    changes = [
        abs(getattr(falls[Drop(ALUMINIUM, height, springs=WEAKER)], name) /
            getattr(falls[Drop(ALUMINIUM, height)], name) - 1.0)
        for height in (LOW, MIDDLE) for name in ("depth", "duration")
    ]  # fmt: skip
    return max(changes), math.sqrt(2.0) * max(scatter["depth"], scatter["duration"])


def _by_force(falls: Falls, ground: Ground, scatter: Scatter) -> tuple[float, float]:
    main = _heights(falls)
    depths = dropped_ball.force_law(main, DIAMETER)[2]
    return max(abs(one / two.depth - 1.0) for one, two in zip(depths, main, strict=True)), scatter["depth"]


MEASURES: dict[str, Callable[[Falls, Ground, Scatter], tuple[float, float]]] = {
    "V23": lambda falls, ground, scatter: _over_total(falls, scatter, "depth"),
    "V24": _over_law,
    "V25": _over_density,
    "V26": lambda falls, ground, scatter: _over_total(falls, scatter, "width"),
    "V27": _duration,
    "V28": _straight,
    "V29": _rebound,
    "V30": _weaker,
    "V31": _by_force,
}
"""Value and error of each claim."""


def draw_drops(falls: dict[Drop, Fall], ground: Ground, path: Path) -> None:
    """Depths beside the law, and the hollows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    mu, h = math.tan(math.radians(ground.angle_deg)), np.geomspace(1e-3, 8.0, 80)
    for density, name, colour in ((WOOD, "wood", "#c08a3e"), (ALUMINIUM, "aluminium", "#2f6f9f"),
                                  (STEEL, "steel", "#444444")):  # fmt: skip
        law = np.array([dropped_ball.depth_by_law(mu, density / ground.density, one) for one in h])
        left.loglog(h + law, law, "-", color=colour, lw=0.9)
        ours = [fall for drop, fall in falls.items() if drop.density == density and drop.springs == 1.0]
        left.plot([one.height + one.depth for one in ours], [one.depth for one in ours], "o", color=colour, label=name)
    left.set_xlabel("total drop H over the ball's diameter")
    left.set_ylabel("depth over diameter (lines: the law)")
    left.legend(frameon=False)
    for height, shade in zip(HEIGHTS[1:], ("0.75", "0.55", "0.3", "0.0"), strict=True):
        one = falls[Drop(ALUMINIUM, height)]
        right.plot(np.array(one.ring) / DIAMETER, np.array(one.ground) / DIAMETER, "-", color=shade,
                   label=f"from {height:g} D")  # fmt: skip
    right.axhline(0.0, color="k", lw=0.5)
    right.set_xlabel("distance from the axis over the ball's diameter")
    right.set_ylabel("ground against before, over diameter")
    right.legend(frameon=False)
    figure.savefig(path, dpi=100)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/results/drops"))
    parser.add_argument("--work", type=Path, default=Path("runs/drops"), help="where the settled beds are kept")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    kept = Kept(options.out / "drops.json")
    ground = Ground(**verdicts.fields(Ground, kept.make("ground", lambda: ground_of(options.work))))
    falls: Falls = {}
    for drop in PLAN:
        row = kept.make(drop.name, functools.partial(one_drop, drop, options.work))
        falls[drop] = Fall(**verdicts.fields(Fall, row))
        if len(falls) >= len(HEIGHTS):  # so that what there is is told where the rest takes long
            now = judged(falls, ground)
            first = verdicts.first_of(options.out, CLAIMS, now)
            resolution = f"{ground.beads:,} beads, ball of {DIAMETER:g} beads"
            verdicts.write(options.out, resolution, first, now, old="first run, close bed")
            draw_drops(falls, ground, options.out / "drops.png")
    d1, k, _ = dropped_ball.force_law(_heights(falls), DIAMETER)
    print(f"force law: d_1 = {d1 / DIAMETER:.3f} D, k D / (m g) = {k * DIAMETER:.2f}")
    print(verdicts.table(CLAIMS, first, now))


def one_drop(drop: Drop, work: Path) -> Fall:
    """A drop of the plan onto the bed of its seed."""
    return dropped_ball.fall(bed_of(drop.seed, work), Ball(DIAMETER, drop.density, drop.height), drop.springs)


if __name__ == "__main__":
    main()
