"""What became of the matter, on a crater's page: what melted and boiled, where what was thrown out came from, and
where it ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from crater.pages import ejecta_fates
from crater.results.findings import Findings
from crater.scaling import melt
from crater.shock import phases, release, settled_matter
from matter.wording import page, readable

TEMPLATE = "crater/pages/templates/report_matter.html.j2"


def all_parts(findings: Findings, out: Path) -> list[str]:
    """Every section that the findings give material for; ``out`` holds the pictures."""
    if findings.shock is None:
        return []
    ejected, projectile = findings.ejected, findings.setting.event.mass
    return [
        molten(findings.shock.molten),
        heated(findings.shock.heat),
        published(findings.shock.melt),
        decay(findings.shock.decay, findings.soundness.get("planar_limit_Pa")),
        excavated(ejected.excavation, projectile, out),
        fates(ejected.fates),
        ejecta_fates.slot() if ejected.fates else "",
        settled(findings.settled_matter, out),
    ]


def molten(facts: Mapping[str, Any]) -> str:
    """Mass above each critical pressure, in projectile masses, one row for each material of each body; empty where no
    material of the run gives any."""
    parts = facts.get("parts", [])
    if not parts:
        return ""
    keys = [key for key in phases.WORDS if any(key in part["pressures_Pa"] for part in parts)]
    return page.render(
        TEMPLATE, "molten", keys=[phases.WORDS[key] for key in keys],
        rows=[[_name(part), *(_cell(part, key) for key in keys)] for part in parts],
        notes=list(dict.fromkeys(f"{part['material']}: {part['source']}." for part in parts)),
        not_known_of=facts.get("not_known_of", []),
    )  # fmt: skip


def _name(part: Mapping[str, Any]) -> str:
    return f"{part['material']} of the {part['body']}"


def heated(facts: Sequence[Mapping[str, Any]]) -> str:
    """Mass that melts and boils by entropy and by temperature, in projectile masses; empty where nothing is known."""
    if not facts:
        return ""
    keys = [key for key in release.WORDS if any(key in part["over_projectile_mass"] for part in facts)]
    rows = [
        [
            _name(part),
            *(
                readable.measured(part["over_projectile_mass"][key], part["counting_error"][key], "")
                if key in part["over_projectile_mass"]
                else "not known"
                for key in keys
            ),
        ]
        for part in facts
    ]
    notes = list(dict.fromkeys(_critical(part["material"], part["critical"]) for part in facts))
    return page.render(TEMPLATE, "heated", keys=[release.WORDS[key] for key in keys], rows=rows, notes=notes)


def published(facts: Mapping[str, Any]) -> str:
    """What published laws say that the impact melts; empty where no energy of the target's material is known."""
    if not facts:
        return ""
    rows = [(melt.WORDS[key], readable.number(value, 3)) for key, value in facts["over_projectile_mass"].items()]
    energy = readable.amount(facts["energy_J_kg"] * 1e-6, "MJ/kg", 3)
    return page.render(TEMPLATE, "published", rows=rows, facts=facts, energy=energy)


def _critical(name: str, facts: Mapping[str, Any]) -> str:
    """What the masses of a material go by, in words."""
    said = []
    for key, word in (("melting", "melts"), ("boiling", "boils")):
        if f"{key}_temperature_K" in facts:
            entropy = f"{key}_begins"
            at = f" ({facts[entropy]:.4g} J/(kg K))" if entropy in facts else ""
            said.append(f"{word} at {facts[f'{key}_temperature_K']:.4g} K{at}")
    if "vapour" in facts:
        said.append(f"is vapour at {facts['vapour']:.4g} J/(kg K)")
    shocks = ", ".join(
        f"{readable.amount(facts[key] * 1e-9, 'GPa', 3)} ({word})"
        for key, word in (
            ("shock_melting_begins_Pa", "melting point"), ("shock_boiling_begins_Pa", "boils"),
            ("shock_vapour_Pa", "vapour"),
        )
        if key in facts
    )  # fmt: skip
    source = f", by {facts['table']}" if "table" in facts else ""
    return f"{name} {', '.join(said)}{source}" + (f"; its Hugoniot reaches them at {shocks}." if shocks else ".")


def decay(facts: Mapping[str, Any], limit: float | None = None) -> str:
    """Isobaric core, beside the planar ``limit`` [Pa], and the power of the decay; empty where nothing is known."""
    if not facts:
        return ""
    core, radius, power = (facts[key] for key in ("core_pressure_Pa", "core_radius_m", "exponent"))
    over = readable.number(facts["core_radius_over_projectile"], 3)
    fraction = f", {core['value'] / limit:.2g} of the planar limit" if limit else ""
    rows = [
        (
            "pressure of the isobaric core",
            readable.measured(core["value"] * 1e-9, core["sigma"] * 1e-9, "GPa") + fraction,
        ),
        ("its radius", f"{readable.measured(radius['value'], radius['sigma'], 'm')}, {over} projectile radii"),
        ("power of the decay beyond it, P ~ r^-n", readable.measured(power["value"], power["sigma"])),
    ]
    return page.render(TEMPLATE, "decay", rows=rows, reach=readable.length(facts["to_m"]))


def _cell(part: Mapping[str, Any], key: str) -> str:
    if key not in part["pressures_Pa"]:
        return "not known"
    value, error = part["over_projectile_mass"][key], part["counting_error"][key]
    above = f"above {readable.amount(part['pressures_Pa'][key] * 1e-9, 'GPa', 3)}"
    return f"{readable.measured(value, error, '')} ({above})" if value > 0.0 else f"none ({above})"


def excavated(facts: Mapping[str, Any], projectile_mass: float, out: Path) -> str:
    """Depth and radius of excavation, shock of what was thrown out, the order of the layers at the rim, and the
    picture of first depths by landing distance; empty where nothing is known."""
    if not facts:
        return ""
    fraction, over = f"{facts['share']:.0%}", facts["mass_kg"] / projectile_mass
    rows = [
        (
            "mass thrown out of the crater",
            f"{readable.amount(facts['mass_kg'], 'kg', 3)} ({over:.3g} of the projectile)",
        ),
        (
            f"depth of excavation ({fraction} of that mass came from above it)",
            f"{readable.length(facts['depth_m'])}, {facts['depth_over_transient_diameter']:.2f} of the transient "
            f"apparent diameter (half of it from above {readable.length(facts['depth_half_m'])})",
        ),
        (f"radius of excavation ({fraction} came from within it)", readable.length(facts["radius_m"])),
    ]
    if peak := facts.get("peak_pressure_Pa"):
        half, most, largest = (readable.amount(peak[key] * 1e-9, "GPa", 3) for key in ("half", "share", "largest"))
        rows.append(
            ("largest pressure that it felt", f"half below {half}, {fraction} below {most}, at most {largest}")
        )
    rows.append(("layers at the rim, above the old ground", _order(facts["rim"])))
    rows.append(("thrown beyond the crater later, by its collapse", readable.amount(facts["later_kg"], "kg", 3)))
    return page.render(TEMPLATE, "excavated", rows=rows, facts=facts, by_distance=out / "excavation.png")


def _order(rim: Mapping[str, Any], what: str = "particles") -> str:
    count = f"{rim['particles']} {what}"
    if "correlation" not in rim:
        return f"undecided ({rim['reason']}: {count})"
    value = f"{rim['correlation']:+.2f} ± {rim['sigma']:.2f}"
    return f"{rim['order']} (rank correlation of height before and after {value}, {count})"


def fates(facts: Mapping[str, Any]) -> str:
    """Mass of target and projectile by fate; empty where nothing is known."""
    if not facts:
        return ""
    rows = [
        [name, *(readable.amount(facts[body][name], "kg", 3) for body in ("target_kg", "projectile_kg"))]
        for name in facts["target_kg"]
    ]
    closure, sizes = f"{max(facts['closure'], 1e-16):.0e}", _by_size(facts.get("size_classes_kg", {}))
    return page.render(TEMPLATE, "fates", rows=rows, facts=facts, closure=closure, by_size=sizes)


def _by_size(facts: Mapping[str, Mapping[str, float]]) -> str:
    """Mass of the target by size class and fate; empty where nothing broke."""
    if not facts:
        return ""
    names = list(next(iter(facts.values())))
    rows = [[name, *(readable.amount(parts[fate], "kg", 3) for fate in names)] for name, parts in facts.items()]
    return page.render(TEMPLATE, "by_size", names=names, rows=rows)


def settled(facts: Mapping[str, Any], out: Path) -> str:
    """Where the matter of the settled crater came from, what of it melted and where that lies; empty where the grains
    do not say."""
    zones = facts.get("zones", {})
    if not zones:
        return ""
    fractions = [field for field in settled_matter.FRACTIONS if any(zone.get(field) for zone in zones.values())]
    rows = [
        [
            name,
            readable.amount(zone["mass_kg"], "kg", 3),
            *(readable.length(zone["first_depth_m"][q]) for q in ("low", "half", "high")),
            readable.length(zone["first_distance_half_m"]),
            readable.amount(zone.get("peak_pressure_half_Pa", float("nan")) * 1e-9, "GPa", 3),
            *(f"{zone.get(field, 0.0):.2%}" for field in fractions),
            f"{zone['projectile_share']:.2%}",
        ]
        for name, zone in zones.items()
    ]
    return page.render(
        TEMPLATE, "settled", fractions=[settled_matter.FRACTIONS[field] for field in fractions], rows=rows, out=out,
        radius=readable.length(facts["radius_m"]), rim=_order(facts["rim"], "grains"), molten=_molten_grains(facts),
    )  # fmt: skip


def _molten_grains(facts: Mapping[str, Any]) -> str:
    """Mass in grains above each critical pressure, inside and outside the crater; empty where none is."""
    found = facts.get("over_projectile_mass", {})
    some = {name: parts for name, parts in found.items() if any(part["value"] > 0.0 for part in parts.values())}
    if not some:
        return ""
    rows = [
        [
            settled_matter.FRACTIONS[name],
            *(
                readable.measured(parts[part]["value"], parts[part]["counting_error"], "") if parts[part]["value"]
                else "none"
                for part in settled_matter.PARTS
            ),
        ]
        for name, parts in some.items()
    ]  # fmt: skip
    unknown = facts.get("not_known_of", [])
    return page.render(TEMPLATE, "molten_grains", parts=list(settled_matter.PARTS), rows=rows, not_known_of=unknown)
