"""The published claims W50-W69 (Winter 2017, chapter 3) and how each is judged; numbering of the project's list of
claims.

Distances to published numbers are judged with both errors in quadrature. Runs are named ``<case>_<variant>``:
``350_base``, ``980_literal``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from crater.ground.radial_profile import Profile
from crater.pages.compare import profile_difference
from studies.winter_2017.evidence import KM, Claim, Finding, Run, Value, ratio_of, within
from studies.winter_2017.published import DEPTH, DIAMETER, MPD, RADII
from studies.winter_2017.series_difference import difference, open_until
from studies.winter_2017.table_9 import table_masses, table_radii, table_ratios
from studies.winter_2017.transient_sizes import (
    angles,
    depth,
    depth_over_diameter,
    diameter,
    equal_energy,
    monotone,
    rim_diameter,
)

START = 180.0
"""Numerical settings are compared from this time [s] on."""


def _same_crater(runs: Mapping[str, Run]) -> Finding:
    many, one = runs["350_base"], runs["350_one"]
    D, H = [[run.transient(name) for run in (many, one)] for name in ("diameter_apparent_m", "depth_m")]
    dD, dH = one.transient("diameter_apparent_m").value - D[0].value, H[1].value - H[0].value
    ours, met, why = f"dD {dD * KM:.0f} km, dH {dH * KM:.0f} km", max(abs(dD), abs(dH)) < MPD["350"], ""
    if many.profile is None or one.profile is None:
        return Finding(ours, "", None, "no transient profile of one of the runs")
    reach = 0.75 * D[0].value
    rms = profile_difference(_cut(many.profile, reach), _cut(one.profile, reach))["rms_m"]
    ours += f", RMS {rms * KM:.0f} km inside 1.5 radii"
    error = f"{math.hypot(D[0].sigma, D[1].sigma) * KM:.0f}, {math.hypot(H[0].sigma, H[1].sigma) * KM:.0f} km"
    if "350_literal" in runs and "350_literal_one" in runs:
        a, b = runs["350_literal"], runs["350_literal_one"]
        why = "literal start: " + ", ".join(
            f"d{letter} {(b.transient(name).value - a.transient(name).value) * KM:.0f} km"
            for letter, name in (("D", "diameter_apparent_m"), ("H", "depth_m"))
        )
    return Finding(ours, error, bool(met and rms < MPD["350"]) if math.isfinite(dD + dH) else None, why)


def _cut(profile: Profile, radius: float) -> Profile:
    near = profile.radius <= radius
    return Profile(
        profile.radius[near],
        profile.height[near],
        profile.p16[near],
        profile.p84[near],
        profile.count[near],
        profile.header,
    )


def _not_deeper(runs: Mapping[str, Run]) -> Finding:
    many, one = runs["350_base"], runs["350_one"]
    H = [run.transient("depth_m") for run in (many, one)]
    deepest = [float(np.nanmax(run.interior["projectile_deepest_m"])) * KM for run in (many, one)]
    dH = H[1].value - H[0].value
    met = bool(dH < 0.5 * MPD["350"]) if math.isfinite(dH) else None
    why = f"projectile matter reached {deepest[0]:.0f} km (many) and {deepest[1]:.0f} km (one)"
    return Finding(f"H(1) - H(81) = {dH * KM:.0f} km", f"{math.hypot(H[0].sigma, H[1].sigma) * KM:.0f} km", met, why)


def _more_ejecta(runs: Mapping[str, Run]) -> Finding:
    pairs = [("350_base", "350_one")] + [("350_literal", "350_literal_one")] * (
        "350_literal" in runs and "350_literal_one" in runs
    )
    told, met = [], None
    for number, (many, one) in enumerate(pairs):
        rows = [[runs[name].inside(column, 396.0) for name in (many, one)] for column in AIRBORNE]
        count = [rows[0][i] + rows[1][i] for i in (0, 1)]
        mass = [rows[2][i] + rows[3][i] for i in (0, 1)]
        met = count[0] > count[1] if number == 0 else met
        told.append(
            f"{many}/{one}: {count[0]:.0f}/{count[1]:.0f} particles (target alone {rows[0][0]:.0f}/{rows[0][1]:.0f}), "
            f"{mass[0]:.3g}/{mass[1]:.3g} kg (target alone {rows[2][0]:.3g}/{rows[2][1]:.3g})"
        )
    return Finding(
        told[0],
        "",
        met,
        "by number; the masses say whether it is more than counting" + ("; " + told[1] if len(told) > 1 else ""),
    )


AIRBORNE = ("airborne_target", "airborne_projectile", "airborne_target_kg", "airborne_projectile_kg")


def _undamaged_ring(runs: Mapping[str, Run]) -> Finding:
    run = runs["350_base"]
    others = "; ".join(f"{name}: {_ring_text(runs[name])}" for name in RING_ELSEWHERE if name in runs)
    if run.damage is None:
        return Finding("", "", None, "no snapshot at 6.6 min")
    return Finding(
        _ring_text(run),
        f"ring width {float(np.median(np.diff(run.damage[0]))) * KM:.0f} km",
        run.annulus is not None,
        others,
    )


RING_ELSEWHERE = (
    "350_literal",
    "350_one",
    "350_ice",
    "350_weak",
    "350_flaws",
    "350_literal_flaws",
    "600_base",
    "980_base",
)


def _ring_text(run: Run) -> str:
    if run.annulus is not None:
        return f"whole from {run.annulus[0] * KM:.0f} to {run.annulus[1] * KM:.0f} km"
    if run.damage is None:
        return "not measured"
    s, damage = run.damage
    broken = s[damage > 0.9]
    lowest = int(np.argmin(damage))
    zone = f"broken (> 0.9) to {broken[-1] * KM:.0f} km" if len(broken) else "nowhere above 0.9"
    return f"none: {zone}, least {damage[lowest]:.2f} at {s[lowest] * KM:.0f} km"


def _time_of_transient(runs: Mapping[str, Run]) -> Finding:
    run = runs["350_base"]
    t = run.transient("time_s")
    why = (
        f"at maximum volume {run.transient('time_s', 'volume').text(1 / 60, 'min', 1)}; scaling 4.7 to 8.9 min; "
        + _variants_of_time(runs)
    )
    return Finding(t.text(1 / 60, "min", 1), f"{t.sigma / 60:.1f} min", within(t, 16.8 * 60, 72.0, 72.0), why)


def _variants_of_time(runs: Mapping[str, Run]) -> str:
    return "; ".join(
        f"{n} {r.transient('time_s').value / 60:.1f} min"
        for n, r in sorted(runs.items())
        if n.startswith("350_") and n != "350_base"
    )


def _vanishes(names: tuple[str, ...]) -> Callable[[Mapping[str, Run]], Finding]:
    def judge(runs: Mapping[str, Run]) -> Finding:
        told, errors, verdicts = [], [], []
        for name in names:
            run = runs[name]
            H, end, minutes = run.transient("depth_m"), run.final_depth, run.end_s / 60
            fraction = ratio_of(end, H) if end.value > 0.0 else Value(0.0, end.sigma / H.value)
            told.append(
                f"{name} {fraction.value:.2f} ({end.value * KM:.0f} of {H.value * KM:.0f} km at {minutes:.0f} min)"
            )
            errors.append(f"{fraction.sigma:.2f}")
            verdicts.append(fraction.value < 0.25 if math.isfinite(fraction.value) else None)
        met = None if None in verdicts else all(verdicts)
        return Finding(
            "; ".join(told), ", ".join(errors), met, "the shock stage alone; its broken ice has no friction"
        )

    return judge


def _penetrates(runs: Mapping[str, Run]) -> Finding:
    told, errors, verdicts, why = [], [], [], []
    for case, through in (("350", False), ("600", True), ("980", True)):
        run = runs[f"{case}_base"]
        H, t = run.transient("depth_m"), run.transient("time_s").value
        told.append(f"{case}: floor {H.value * KM:.0f} of {run.shell_m * KM:.0f} km")
        errors.append(f"{H.sigma * KM:.0f}")
        verdicts.append((H.value > run.shell_m) == through if math.isfinite(H.value) else None)
        if math.isfinite(t):
            why.append(
                f"{case}: at {t / 60:.1f} min {100 * run.inside('projectile_below_shell', t):.0f} % of the projectile "
                f"below the shell's base, deepest ever "
                f"{np.nanmax(run.interior['projectile_deepest_m']) * KM:.0f} km, base pushed down "
                f"{run.inside('interface_down_m', t) * KM:.0f} km "
                f"(most {run.inside('interface_down_most_m', t) * KM:.0f}), ocean above its level "
                f"{run.inside('below_risen_kg', t):.2g} kg then, "
                f"{np.nanmax(run.interior['below_risen_kg']):.2g} kg later at most"
            )
    return Finding(
        "; ".join(told), ", ".join(errors) + " km", None if None in verdicts else all(verdicts), "; ".join(why)
    )


def _projectile_for_diameter(runs: Mapping[str, Run]) -> Finding:
    diameters = {c: runs[f"{c}_base"].transient("diameter_apparent_m") for c in DIAMETER}
    verdicts = [within(D, *DIAMETER[c]) for c, D in diameters.items()]
    ratio = ratio_of(diameters["980"], diameters["600"])
    told = "; ".join(f"d = {2 * RADII[c][1]:.1f} km -> D = {D.text()}" for c, D in diameters.items())
    why = (
        f"D980/D600 = {ratio.value:.2f} +- {ratio.sigma:.2f}, published 1.63; a third more energy gives 1.07 to 1.08 "
        f"by any scaling"
    )
    return Finding(
        told,
        ", ".join(f"{D.sigma * KM:.0f}" for D in diameters.values()) + " km",
        None if None in verdicts else all(verdicts),
        why,
    )


def _rings(runs: Mapping[str, Run]) -> Finding:
    told, verdicts = [], []
    for case, over in (("350", False), ("980", True)):
        run = runs[f"{case}_base"]
        ratio = run.transient("depth_m").value / run.shell_m
        told.append(f"{case}: H / shell = {ratio:.2f}")
        verdicts.append((ratio > 1.0) == over if math.isfinite(ratio) else None)
    errors = ", ".join(
        f"{runs[f'{c}_base'].transient('depth_m').sigma / runs[f'{c}_base'].shell_m:.2f}" for c in ("350", "980")
    )
    return Finding(
        "; ".join(told),
        errors,
        None if None in verdicts else all(verdicts),
        "a preference of the thesis, not a measurement",
    )


def _setting(name: str) -> Callable[[Mapping[str, Run]], Finding]:
    def judge(runs: Mapping[str, Run]) -> Finding:
        a, b = runs["980_base"].series, runs[name].series
        end = open_until(a["time_s"], a["depth_m"])
        differences = {
            w: difference(a["time_s"], a[c], b["time_s"], b[c], START, end)
            for w, c in (("D", "diameter_apparent_m"), ("depth", "depth_m"))
        }
        ours = ", ".join(
            f"{w} {100 * x.relative:.1f} % (at {x.at_s / 60:.0f} min; at all other times at most "
            f"{100 * x.otherwise:.1f} %)"
            for w, x in differences.items()
        )
        sizes = ", ".join(
            f"{w} {100 * float(np.nanmedian(a[c + '_sigma'] / a[c])):.1f} %"
            for w, c in (("D", "diameter_apparent_m"), ("depth", "depth_m"))
        )
        met = all(x.relative < 0.02 for x in differences.values())
        return Finding(
            ours,
            f"of the measuring, median: {sizes}",
            met,
            f"3 min until the depth is half of its largest ({end / 60:.0f} min)",
        )

    return judge


CLAIMS = (
    Claim("W50", "81 and 1 projectile particles give the same crater (Fig. "
                 "20)", "almost identical", "dD, dH < 26 km, RMS < 26 km",
          ("350_base", "350_one"), _same_crater),
    Claim("W51", "a single heavy particle does not penetrate "
                 "deeper", "not deeper", "dH < 13 km", ("350_base", "350_one"), _not_deeper),
    Claim("W52", "more ejecta with 81 particles, at 6.6 "
                 "min", "significantly more", "number(81) > number(1); masses beside it",
          ("350_base", "350_one"), _more_ejecta),
    Claim("W53", "an undamaged ring surrounds the crater at 6.6 "
                 "min", "ring", "damage < 0.5 between two zones > 0.9", ("350_base",), _undamaged_ring),
    Claim("W54", "350 km: transient crater fully "
                 "developed", "16.8 +- 1.2 min", "within both errors", ("350_base",), _time_of_transient),
    *(Claim(i, f"{c} km: transient depth", f"{DEPTH[c] * KM:.0f} +- {MPD[c] * KM:.0f} "
                                           f"km", "within both errors", (f"{c}_base",), depth(c))
      for i, c in (("W55", "350"), ("W56", "600"), ("W57", "980"))),
    *(Claim("W58", f"{c} km: transient diameter", f"{c} +{DIAMETER[c][1] * KM:.0f} -{DIAMETER[c][2] * KM:.0f} "
                                                  f"km", "within both errors",
            (f"{c}_base",), diameter(c)) for c in DIAMETER),
    *(Claim("W58", f"{c} km: the same, rim crest to rim crest (Figure 8 defines D "
                   f"so)", f"{c} +{DIAMETER[c][1] * KM:.0f} -{DIAMETER[c][2] * KM:.0f} km",
            "within both errors", (f"{c}_base",), rim_diameter(c)) for c in DIAMETER),
    Claim("W59", "transient H/D of the three", "0.214, 0.375, 0.306", "0.21 to 0.38", ("350_base", "600_base",
    "980_base"), depth_over_diameter),
    *(Claim("W60", f"{c} km: the crater disappears almost "
                   f"completely", "disappears", "final depth < 0.25 of the transient",
            (f"{c}_base",), _vanishes((f"{c}_base",))) for c in DEPTH),
    Claim("W61", "it flattens without an ocean too", "flattens", "the same, ocean replaced by ice", ("350_ice",),
    _vanishes(("350_ice",))),
    Claim("W61", "the same, published (literal) start", "flattens", "the same, ocean replaced by ice",
    ("350_literal_ice",), _vanishes(("350_literal_ice",))),
    Claim("W61", "the same, 980 km", "flattens", "the same, ocean replaced by ice", ("980_ice",), _vanishes(("980_ice",
    ))),
    Claim("W62", "600 and 980 penetrate the shell into the ocean, 350 does "
                 "not", "yes, yes, no", "floor against the shell's thickness",
          ("350_base", "600_base", "980_base"), _penetrates),
    Claim("W63", "depth grows with diameter (Fig. 22)", "(350, 75), (600, 225), (980, 300) km", "monotone",
    ("350_base", "600_base", "980_base"), monotone),
    *(Claim("W64", f"{c} km: steeper is deeper, D the same (Fig. "
                   f"23)", "H15 > H40 > H65", "H15/H65 > 1.3, D spread < 15 %",
            (f"{c}_angle15", f"{c}_base", f"{c}_angle65"), angles(c)) for c in ("350", "980")),
    Claim("W65", "Table 9, radii", "see Table 9", "0.2 %", (), table_radii),
    Claim("W66", "Table 9, masses [1e16 kg]", "see Table 9", "0.2 %", (), table_masses),
    Claim("W67", "Table 9, projectile over crater diameter", "see Table 9", "rounding", (), table_ratios),
    *(Claim("Table 9", f"{c} km: equal energy gives the same D", "ratio 1", "within the published error of D",
    (f"{c}_base", f"{c}_v1", f"{c}_v3", f"{c}_v4"),
            equal_energy(c)) for c in ("350", "980")),
    Claim("W68", "projectile diameters for the three "
                 "craters", "52.5 -> 350, 98 -> 600, 107.8 -> 980 km", "within both errors",
          ("350_base", "600_base", "980_base"), _projectile_for_diameter),
    Claim("W69", "rings need a crater deeper than the shell: 980 yes, 350 "
                 "no", "H > shell, H < shell", "sign", ("350_base", "980_base"), _rings),
    Claim("numerics", "980 km, Courant factor halved: D(t), "
                      "depth(t)", "no change", "2 %", ("980_base", "980_courant"), _setting("980_courant")),
    Claim("numerics", "980 km, gravity at every step: D(t), "
                      "depth(t)", "no change", "2 %", ("980_base", "980_gravity"), _setting("980_gravity")),
)  # fmt: skip
"""Every claim of the table, in its order."""
