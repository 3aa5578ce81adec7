"""The disruption of a basalt sphere beside Nakamura & Fujiwara (1991): table, picture, verdicts from finished runs.

    python studies/nakamura_fujiwara.py RUNS [--out docs/results/nakamura_fujiwara]

RUNS is a folder below which run folders of ``cases/nakamura_fujiwara`` lie, at any depth. The largest fragment is that
of ``sph.outcome.fragments``. Speeds are medians over the outermost two millimetres of the sphere by where matter
began: within 30 deg of the impact point (spall) and of its antipode. Verdicts use the default law of damage growth,
with the default numerics and the former ones; other laws and other choices stand beside it.
"""

from __future__ import annotations

import argparse
import json
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from matter.case import material, quantity
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.geometry.connected import BROKEN
from sph.outcome import fragments
from sph.stepping.numerics import SETS

ROOT = Path(__file__).resolve().parents[1]
CASE = "nakamura_fujiwara"
DEFAULT = "cube_root"
DEFAULT_SET = "reconstructed"
SKIN = 2e-3
NEAR = 30.0


WORDS = {
    "gradients": "other gradients",
    "viscosity_switch": "Morris & Monaghan's switch",
}
"""What a run is said to do otherwise than its set of numerics, by the key of ``[sph]``."""


def measure(run: Path) -> dict[str, Any]:
    """All that is read from one run."""
    used = tomllib.loads((run / "case.used.toml").read_text())
    choice = used["sph"].get("materials", {}).get("basalt", {})
    law = choice.get("damage") or material.choices("basalt").get("damage", DEFAULT)
    fractions, times, broken = [], [], []
    for file in sorted((run / "2_sph").glob("snap_*.vtkhdf")):
        particles = snapshot.read(file)
        target = particles.layer >= 0
        times.append(float(particles.attributes["time"]))
        fractions.append(fragments.largest_fraction(particles))
        broken.append(
            float(particles.mass[target & (particles.damage >= BROKEN)].sum() / particles.mass[target].sum())
        )
    x, speed = particles.initial_position, np.linalg.norm(particles.velocity, axis=1)
    r = np.linalg.norm(x, axis=1)
    angle = np.degrees(np.arccos(np.clip(x[:, 2] / np.maximum(r, 1e-9), -1.0, 1.0)))
    skin = target & (r > particles.attributes["target_radius_m"] - SKIN)
    pieces = fragments.find(particles)
    report = json.loads((run / "2_sph" / "stage_report.json").read_text())
    spacing = quantity.parse(used["sph"]["spacing_at_impact"], "m")
    within = lambda mine, fraction: float(np.percentile(speed[skin & mine], fraction))  # noqa: E731
    return {
        "run": run.name, "law": law, "seed": used["sph"]["seed"],
        "flaws": ", ".join(str(value) for value in choice.get("weibull", {}).values()),
        "set": used["sph"]["numerics"], "viscosity": [used["sph"]["alpha"], used["sph"]["beta"]],
        "numerics": odd(used["sph"]),
        "spacing_m": spacing, "particles": int(target.sum()), "steps": report["steps"],
        "times_s": times, "largest": fractions, "broken": broken,
        "second": pieces[1].mass / float(particles.mass[target].sum()) if len(pieces) > 1 else 0.0,
        "fragments": len(pieces),
        "largest_speed_m_s": float(np.linalg.norm(pieces[0].velocity)) if pieces else 0.0,
        "spall_m_s": [within(angle < NEAR, fraction) for fraction in (10, 50, 90)],
        "antipode_m_s": [within(angle > 180.0 - NEAR, fraction) for fraction in (10, 50, 90)],
        "peak_Pa": float(particles.peak_pressure[target].max()),
        "energy_drift": report["drift_over_projectile"]["energy_J"],
    }  # fmt: skip


def odd(sph: dict[str, Any]) -> list[str]:
    """What a run's numerics have otherwise than their set, but for the viscosity."""
    usual = {"viscosity_switch": "none"} | SETS[sph["numerics"]]
    return [words for key, words in WORDS.items() if sph.get(key, usual[key]) != usual[key]]


def found(folder: Path, kept: dict[str, Any]) -> dict[str, Any]:
    """Measures of all finished runs below a folder, by the run folder's name; those in ``kept`` are taken as they
    are."""
    for done in sorted(folder.rglob("2_sph/done.json")):
        run = done.parents[1]
        if run.name.startswith(CASE + "-") and run.name not in kept:
            print(f"measuring {run.name}", flush=True)
            kept[run.name] = measure(run)
    return kept


def nominal(row: dict[str, Any]) -> bool:
    """Whether a run is one that verdicts use: all but numerics and viscosity as the case has it, and with the default
    numerics any draw of the flaws."""
    drawn = row["seed"] == 1 or row["set"] == DEFAULT_SET
    return row["law"] == DEFAULT and not row["flaws"] and drawn and not row["numerics"]


CRACKS = (
    "A crack has crossed a particle after R_s / c_g: R_s is the radius of the sphere of its volume, 0.62 spacings, in "
    "`cube_root`, `single` and `fraction`, "
    "and the support h (2 or 2.6 spacings) in `linear` and `weibull`, after the codes that have them. Codes that take "
    "h in the other laws too break more slowly, "
    "by a factor of 3.2."
)
"""Stands where fragments are compared: beside flaws and law they hang on it."""


def name(row: dict[str, Any]) -> str:
    """A run's law, and its flaws (k, m), seed and numerics where they are not the case's."""
    seed = [f"seed {row['seed']}"] if row["seed"] != 1 else []
    other = ([f"flaws {row['flaws']}"] if row["flaws"] else []) + seed + row["numerics"]
    return row["law"] + (f" ({'; '.join(other)})" if other else "")


def viscosity(row: dict[str, Any]) -> str:
    """Numerics, and alpha and beta, as text."""
    return "{} ({:g}, {:g})".format(row["set"], *row["viscosity"])


def verdicts(rows: list[dict[str, Any]]) -> list[dict[str, str]]:
    """V05 at each resolution and viscosity of the default law."""
    made = []
    for row in (row for row in rows if nominal(row)):
        others = ", ".join(
            f"{name(other)} {other['largest'][-1]:.3f}"
            for other in rows
            if other["spacing_m"] == row["spacing_m"] and viscosity(other) == viscosity(row) and other is not row
        )
        spall, antipode = row["spall_m_s"], row["antipode_m_s"]
        ours = (
            f"largest fragment {row['largest'][-1]:.3f}; antipode {antipode[1]:.1f} m/s (10 to 90 %: "
            f"{antipode[0]:.1f} to {antipode[2]:.1f}), "
        )
        ours += f"spall {spall[1]:.0f} m/s ({spall[0]:.0f} to {spall[2]:.0f}); peak {1e-9 * row['peak_Pa']:.1f} GPa"
        met = 0.2 <= row["largest"][-1] <= 0.4
        usual = [SETS[row["set"]][key] for key in ("alpha", "beta")]
        tried = "" if row["viscosity"] == usual else "viscosity tried after the first comparison; "
        if row["set"] != DEFAULT_SET:
            tried = "the former numerics; " + tried
        why = f"{tried}second fragment {row['second']:.4f}; " + (
            f"at this size: {others}" if others else "other laws not run at this size"
        )
        made.append(
            {
                "id": "V05",
                "ours": ours,
                "verdict": "met" if met else "not met",
                "resolution": resolution(row),
                "why": why,
            }
        )
    return made


def resolution(row: dict[str, Any]) -> str:
    """Words for a run's size and viscosity."""
    return f"{row['particles']:,} particles, {1e3 * row['spacing_m']:.2f} mm, {viscosity(row)}"


def table(rows: list[dict[str, Any]]) -> str:
    """Every run in one table."""
    text = [
        "| law | resolution, numerics (alpha, beta) | largest fragment | second | broken "
        "| antipode, 10 / 50 / 90 % [m/s] | spall | peak [GPa] | energy |",
        "|---" * 9 + "|",
    ]
    for row in rows:
        speeds = [" / ".join(f"{v:.3g}" for v in row[which]) for which in ("antipode_m_s", "spall_m_s")]
        text.append(
            f"| {name(row)} | {resolution(row)} | {row['largest'][-1]:.3f} | {row['second']:.4f} | "
            f"{row['broken'][-1]:.3f} | {speeds[0]} | {speeds[1]} "
            f"| {1e-9 * row['peak_Pa']:.1f} | {100 * row['energy_drift']:+.3f} % |"
        )
    return "\n".join(text) + "\n\n" + CRACKS + "\n"


def picture(folder: Path, rows: list[dict[str, Any]], out: Path) -> None:
    """Largest fragment in time, and damage at the end in a slice for the default law, one panel a resolution."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    shown = [row for row in rows if nominal(row) and row["seed"] == 1]
    folders = {path.parents[1].name: path.parent for path in folder.rglob("2_sph/done.json")}
    cuts = [row for row in shown if row["set"] == DEFAULT_SET and row["run"] in folders]
    figure, axes = plt.subplots(
        1, 1 + len(cuts), figsize=(5.0 * (1 + len(cuts)), 4.5), squeeze=False, layout="constrained"
    )
    sizes, kinds = sorted({row["spacing_m"] for row in shown}), sorted({viscosity(row) for row in shown})
    for row in shown:
        style = ("-", "--", ":", "-.")[sizes.index(row["spacing_m"]) % 4]
        label = f"{viscosity(row)}, {row['particles']:,}"
        axes[0, 0].plot(
            1e6 * np.array(row["times_s"]), row["largest"], style, color=f"C{kinds.index(viscosity(row))}", label=label
        )
    axes[0, 0].axhspan(0.2, 0.4, color="0.9")
    axes[0, 0].set(xlabel="t [us]", ylabel="largest fragment over the target", ylim=(0, 1))
    axes[0, 0].legend(fontsize=5, ncols=2, loc="lower left", title="numerics (alpha, beta), particles")
    for panel, row in zip(axes[0, 1:], cuts):
        particles = snapshot.read(folders[row["run"]] / "last.vtkhdf")
        cut = (np.abs(particles.position[:, 1]) < 0.5 * row["spacing_m"]) & (particles.layer >= 0)
        x = 100 * particles.position[cut]
        dots = panel.scatter(
            x[:, 0],
            x[:, 2],
            c=particles.damage[cut],
            s=2.5e6 * row["spacing_m"] ** 2,
            cmap="inferno_r",
            vmin=0,
            vmax=1,
            lw=0,
        )
        panel.set(
            xlim=(-4, 4),
            ylim=(-4, 4),
            aspect="equal",
            xlabel="cm",
            title=f"damage at {1e6 * row['times_s'][-1]:.0f} us, {resolution(row)}",
        )
        panel.title.set_fontsize(8)
        figure.colorbar(dots, ax=panel, shrink=0.8)
    figure.savefig(out / "fragments.png", dpi=100)
    plt.close(figure)


def main() -> int:
    """Exit code 0, 2 for bad input."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "results" / "nakamura_fujiwara")
    given = parser.parse_args()
    path = given.out / "measures.json"
    try:
        kept = found(given.runs, json.loads(path.read_text()) if path.exists() else {})
        if not kept:
            raise InputError(f"no finished run of {CASE} below {given.runs}")
    except InputError as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    given.out.mkdir(parents=True, exist_ok=True)
    archive.write_text(path, json.dumps(kept, separators=(",", ":")))
    order = lambda row: (row["set"] != DEFAULT_SET, row["spacing_m"], viscosity(row), not nominal(row), name(row))  # noqa: E731
    rows = sorted(kept.values(), key=order)
    archive.write_text(given.out / "table.md", table(rows))
    archive.write_text(
        given.out / "verdicts.json", json.dumps({"resolution": "", "verdicts": verdicts(rows)}, indent=1) + "\n"
    )
    picture(given.runs, rows, given.out)
    print(table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
