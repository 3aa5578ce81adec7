"""How the claims on depth and diameter of the transient craters are judged: each size, their ratio and order, the
angle of impact, impacts of equal energy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping

import numpy as np

from studies.winter_2017.evidence import KM, Finding, Run, ratio_of, within
from studies.winter_2017.published import DEPTH, DIAMETER, MPD, PUBLISHED_TIME, SPEEDS


def _variants(
    runs: Mapping[str, Run], case: str, quantity: str, scale: float, unit: str, at: str = "depth", but: str = ""
) -> str:
    """The same quantity of every other run of a case, as text."""
    told = [
        f"{name} {run.transient(quantity, at).text(scale, unit)}"
        for name, run in sorted(runs.items())
        if name.startswith(case) and name != but
    ]
    return "; ".join(told)


def depth(case: str) -> Callable[[Mapping[str, Run]], Finding]:
    """Whether the greatest depth of a crater is the published one, within its mean spacing; other starts beside it."""

    def judge(runs: Mapping[str, Run]) -> Finding:
        H = runs[f"{case}_base"].transient("depth_m")
        why = (
            "; ".join(
                told
                for kind in ("literal", "weak")
                if (told := _variants(runs, f"{case}_{kind}", "depth_m", KM, "km"))
            )
            + "; at maximum volume "
            + runs[f"{case}_base"].transient("depth_m", "volume").text()
        )
        why += "; " + _pair_notes(runs, case)
        return Finding(
            H.text(), f"{H.sigma * KM:.0f} km", within(H, DEPTH[case], MPD[case], MPD[case]), why.strip("; ")
        )

    return judge


def diameter(case: str) -> Callable[[Mapping[str, Run]], Finding]:
    """Whether the apparent diameter at the greatest depth is the published one, within its errors."""

    def judge(runs: Mapping[str, Run]) -> Finding:
        run = runs[f"{case}_base"]
        D = run.transient("diameter_apparent_m")
        why = (
            f"at maximum volume {run.transient('diameter_apparent_m', 'volume').text()}, rim "
            f"{run.transient('diameter_rim_m', 'volume').text()}"
        )
        if scaling := run.facts.get("scaling_m"):
            why += f"; gravity scaling {scaling[0] * KM:.0f} to {scaling[1] * KM:.0f} km"
        for kind in ("literal", "weak"):
            if told := _variants(runs, f"{case}_{kind}", "diameter_apparent_m", KM, "km"):
                why += f"; {told}"
        if (late := _at(run, "diameter_apparent_m", PUBLISHED_TIME)) is not None:
            why += f"; at the published {PUBLISHED_TIME / 60:.1f} min, in collapse, D is {late * KM:.0f} km"
        if told := _pair_notes(runs, case):
            why += f"; {told}"
        return Finding(D.text(), f"{D.sigma * KM:.0f} km", within(D, *DIAMETER[case]), why)

    return judge


def rim_diameter(case: str) -> Callable[[Mapping[str, Run]], Finding]:
    """Whether the diameter of the rim at the largest volume is the published one, within its errors."""

    def judge(runs: Mapping[str, Run]) -> Finding:
        D = runs[f"{case}_base"].transient("diameter_rim_m", "volume")
        t = runs[f"{case}_base"].transient("time_s", "volume")
        told = (
            f"{runs[f'{case}_literal'].transient('diameter_rim_m', 'volume').text()} from the literal start; "
            if f"{case}_literal" in runs
            else ""
        )
        return Finding(
            D.text(),
            f"{D.sigma * KM:.0f} km",
            within(D, *DIAMETER[case]),
            f"{told}at maximum volume, {t.text(1 / 60, 'min', 1)}",
        )

    return judge


def _at(run: Run, name: str, time: float) -> float | None:
    """A measure of the series at the snapshot nearest to ``time`` [s]; None where there is none within a minute."""
    known = np.flatnonzero(np.isfinite(run.series[name]))
    if len(known) == 0:
        return None
    nearest = known[np.argmin(np.abs(run.series["time_s"][known] - time))]
    return float(run.series[name][nearest]) if abs(run.series["time_s"][nearest] - time) <= 60.0 else None


def _nearest_to_published(run: Run, case: str) -> str:
    """When D(t) and H(t) together come nearest to the published pair, and how near in its errors: tells a crater of
    another size from one taken at another time."""
    t, D, H = (run.series[name] for name in ("time_s", "diameter_apparent_m", "depth_m"))
    D0, plus, minus = DIAMETER[case]
    with np.errstate(invalid="ignore"):
        off = np.maximum(np.abs(D - D0) / np.where(D > D0, plus, minus), np.abs(H - DEPTH[case]) / MPD[case])
    if not np.isfinite(off).any():
        return ""
    at = int(np.nanargmin(off))
    both = "within both errors" if off[at] <= 1.0 else f"{off[at]:.1f} errors off"
    phase = "growing" if t[at] <= run.transient("time_s").value else "collapsing"
    return (
        f"{run.name} comes nearest to the published pair at {t[at] / 60:.1f} min, {phase}: D {D[at] * KM:.0f}, H "
        f"{H[at] * KM:.0f} km, {both}"
    )


def _pair_notes(runs: Mapping[str, Run], case: str) -> str:
    return "; ".join(
        note
        for name in (f"{case}_base", f"{case}_literal", f"{case}_weak")
        if name in runs and (note := _nearest_to_published(runs[name], case))
    )


def depth_over_diameter(runs: Mapping[str, Run]) -> Finding:
    """Whether H / D of the three craters lies between 0.21 and 0.38."""
    ratios = [
        ratio_of(runs[f"{c}_base"].transient("depth_m"), runs[f"{c}_base"].transient("diameter_apparent_m"))
        for c in DEPTH
    ]
    met = all(0.21 <= r.value <= 0.38 for r in ratios) if all(math.isfinite(r.value) for r in ratios) else None
    at_volume = ", ".join(f"{runs[f'{c}_base'].transient('depth_over_diameter', 'volume').value:.2f}" for c in DEPTH)
    errors = ", ".join(f"{r.sigma:.3f}" for r in ratios)
    return Finding(", ".join(f"{r.value:.3f}" for r in ratios), errors, met, f"at maximum volume {at_volume}")


def monotone(runs: Mapping[str, Run]) -> Finding:
    """Whether the larger of two craters is wider and deeper."""
    pairs = [
        (runs[f"{c}_base"].transient("diameter_apparent_m"), runs[f"{c}_base"].transient("depth_m")) for c in DEPTH
    ]
    known = all(math.isfinite(D.value + H.value) for D, H in pairs)
    met = (
        all(b[0].value > a[0].value and b[1].value > a[1].value for a, b in itertools.pairwise(pairs))
        if known
        else None
    )
    told = ", ".join(f"({D.value * KM:.0f}, {H.value * KM:.0f})" for D, H in pairs)
    return Finding(
        f"(D, H) = {told} km", ", ".join(f"({D.sigma * KM:.0f}, {H.sigma * KM:.0f})" for D, H in pairs) + " km", met
    )


def angles(case: str) -> Callable[[Mapping[str, Run]], Finding]:
    """Whether steep impacts are deeper, by 1.3 from 65 to 15 deg, at diameters within 15 %."""

    def judge(runs: Mapping[str, Run]) -> Finding:
        three = [runs[f"{case}_{name}"] for name in ("angle15", "base", "angle65")]
        H, D = [run.transient("depth_m") for run in three], [run.transient("diameter_apparent_m") for run in three]
        if not all(math.isfinite(x.value) for x in (*H, *D)):
            return Finding("", "", None, "a run shows no transient crater")
        ratio, mean = ratio_of(H[0], H[2]), float(np.mean([d.value for d in D]))
        spread = (max(d.value for d in D) - min(d.value for d in D)) / mean
        met = H[0].value > H[1].value > H[2].value and ratio.value > 1.3 and spread < 0.15
        told = ", ".join(f"{h.value * KM:.0f}" for h in H)
        ours = (
            f"H {told} km, H15/H65 = {ratio.value:.2f}; D {', '.join(f'{d.value * KM:.0f}' for d in D)} km, spread "
            f"{100 * spread:.0f} %"
        )
        error = f"ratio {ratio.sigma:.2f}; D {max(d.sigma for d in D) * KM:.0f} km"
        scaling = (math.cos(math.radians(15)) / math.cos(math.radians(65))) ** (1 / 3)
        return Finding(
            ours,
            error,
            met,
            f"gravity scaling: D15/D65 = {scaling:.2f} (cos^(1/3)), ours {D[0].value / D[2].value:.2f}",
        )

    return judge


def equal_energy(case: str) -> Callable[[Mapping[str, Run]], Finding]:
    """Whether impacts of equal energy at other speeds leave the same diameter, within the published errors of it."""

    def judge(runs: Mapping[str, Run]) -> Finding:
        base = runs[f"{case}_base"]
        D, H, errors, verdicts = [], [], [], []
        D0, plus, minus = DIAMETER[case]
        for name in ("v1", "v3", "v4"):
            run = runs[f"{case}_{name}"]
            d = ratio_of(run.transient("diameter_apparent_m"), base.transient("diameter_apparent_m"))
            h = ratio_of(run.transient("depth_m"), base.transient("depth_m"))
            D.append(f"{name} {d.value:.2f}")
            H.append(f"{name} {h.value:.2f}")
            errors.append(f"{d.sigma:.2f}, {h.sigma:.2f}")
            verdicts.append(None if not math.isfinite(d.value) else within(d, 1.0, plus / D0, minus / D0))
        scaling = [(v / SPEEDS[1]) ** (0.434 - 0.783 * 2 / 3) for v in (SPEEDS[0], *SPEEDS[2:])]
        why = "gravity scaling (D ~ d^0.783 v^0.434) gives " + ", ".join(f"{s:.2f}" for s in scaling)
        return Finding(
            f"D ratio {', '.join(D)}; H ratio {', '.join(H)}",
            "; ".join(errors),
            None if None in verdicts else all(verdicts),
            why,
        )

    return judge
