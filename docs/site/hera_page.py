"""What Hera should see at Dimorphos, for people (``hera.md.j2``): every number of ours is read from
``forecasts/hera_v0.toml`` and its draws. What others published stands here, as in ``forecasts/README.md``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from matter.files import archive

ROOT = Path(__file__).resolve().parents[2]
FORECAST = ROOT / "forecasts" / "hera_v0.toml"
PICTURE = "hera.svg"
SCALES = {"mass": (1e-9, 1), "density": (1.0, -1), "hollow": (1.0, 0), "deepest": (1.0, 0), "resurfaced": (100.0, 0),
          "mass_left": (1e-6, 0), "plane_turned": (1.0, 1)}  # fmt: skip
"""Of a quantity: factor from SI and digits; the others are ratios with two."""
ROWS = (
    ("mass", "mass, million tonnes", "4.3 if as dense as Didymos, 2,400 kg/m3, as was assumed"),
    ("density", "bulk density, kg/m3", "1,540 +- 220 (Makadia et al. 2026, went in); below 2,400 (Raducan et al. "
     "2024)"),
    ("a_over_b", "longest over middle axis", "about 1.3 (Naidu et al. 2024, from the orbit)"),
    ("a_over_c", "longest over shortest axis", "about 1.6 (Naidu et al. 2024)"),
    ("hollow", "width of the hollow, m", "no crater but another shape (Raducan & Jutzi 2022); 50 m would do for the "
     "boulders (Jewitt et al. 2023)"),
    ("deepest", "its depth, m", "–"),
    ("resurfaced", "new surface, %", "8 % of the mass moved (Raducan et al. 2024)"),
    ("mass_left", "mass thrown out for good, thousand tonnes", "11 to 55 (Ferrari et al. 2025); 17 to 22 (Kim & "
     "Jewitt 2023); 0.5 to 1 % of the body (Raducan et al. 2024)"),
    ("beta_ejecta", "push, over that of the spacecraft alone (beta)", "3.61 +0.19 -0.25 if 2,400 kg/m3; 2.2 to 4.9 "
     "for 1,500 to 3,300 (Cheng et al. 2023)"),
    ("plane_turned", "tilt of the orbit, deg", "up to 1 (Farnham et al. 2025)"),
)  # fmt: skip


def page(site: Path) -> str:
    """The page as Markdown; its picture is written into ``site`` where there is matplotlib."""
    content = tomllib.loads(FORECAST.read_text())
    column = content["headline"]
    entries = {one["name"]: one for one in content["quantity"]}
    template = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent), undefined=jinja2.StrictUndefined, trim_blocks=True
    ).get_template("hera.md.j2")
    return template.render(
        frozen=content["frozen"], picture=PICTURE if drawn(site, column) else "", rows=ROWS,
        chance=content["class"][f"p_{column}"], excited=content["rotation"][f"p_{column}"],
        percent=lambda part: f"{100 * part:.0f} %", of=lambda name: shown(entries[name], column),
    )  # fmt: skip


def shown(entry: Mapping[str, Any], column: str) -> dict[str, str]:
    """Middle and ends of a quantity as this page words them, and whether it was simulated."""
    factor, digits = SCALES.get(entry["name"], (1.0, 2))
    values = [f"{round(factor * value, digits):,.{max(digits, 0)}f}" for value in entry[column]]
    basis = "estimate" if entry["basis"] == "estimate" else "runs"
    return dict(zip(("low", "less", "middle", "more", "high"), values)) | {"basis": basis}


def drawn(site: Path, column: str) -> bool:
    """Draw the outline over the equator with DART's side below. Whether there is matplotlib to do it."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return False
    arrays, _ = archive.read(FORECAST.with_name(f"{FORECAST.stem}_draws.h5"))
    wide, deep = (arrays[f"{column}/{name}"].astype(float) for name in ("hollow", "deepest"))
    figure = Figure(figsize=(5.0, 5.0), layout="constrained")
    axes = figure.subplots()
    for k in range(0, len(wide), len(wide) // 150):
        axes.plot(*outline(wide[k], deep[k]), color="#b03a2e", lw=0.5, alpha=0.12)
    axes.plot(*outline(float(np.median(wide)), float(np.median(deep))), color="#7b241c", lw=2.0, label="as expected")
    axes.plot(*outline(1.0, 0.0), "--", color="#37474f", lw=1.0, label="before DART")
    axes.annotate("DART", (0.0, -89.0), (0.0, -122.0), ha="center", arrowprops={"arrowstyle": "->"})
    axes.set(aspect="equal", xlabel="m", ylabel="m", ylim=(-130.0, 110.0))
    axes.legend(loc="center", frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(site / PICTURE, metadata={"Date": None})
    return True


def outline(wide: float, deep: float) -> tuple[np.ndarray, np.ndarray]:
    """x and y [m] of the equator of 177 x 174 m, with a parabolic hollow about (0, -87 m)."""
    angle = np.linspace(-0.5 * np.pi, 1.5 * np.pi, 721)
    x, y = 88.5 * np.cos(angle), 87.0 * np.sin(angle)
    arc = 87.75 * np.minimum(angle + 0.5 * np.pi, 1.5 * np.pi - angle)
    cut = 1.0 - deep * np.maximum(1.0 - (2.0 * arc / wide) ** 2, 0.0) / 87.75
    return x * cut, y * cut
