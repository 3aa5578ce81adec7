"""Pictures of porosity: paths of crushing and unloading, crush curves, damage by crushing, compaction waves."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from sph.eos import tillotson
from sph.materials.rows import collect
from sph.porosity import compaction_damage, crush, crush_quadratic, dispatch, p_alpha, strain_alpha
from sph.porosity.matrix import Matrix
from sph.shock_states import compaction_wave


def path(law: ModuleType, axes: Any) -> str:
    """Distention and pressure on a way of loading, unloading and loading again."""
    rock = tillotson.EXAMPLE
    kind = next(k for k in range(1, len(dispatch.FAMILY.names)) if dispatch.FAMILY.module(k) is law)
    curve = crush.FAMILY.kind("quadratic")
    example = law.EXAMPLE
    if law.CRUSHES:  # with an elastic part, so that the picture shows it
        example = example._replace(elastic_speed=2000.0, solid_speed=3145.0)
    pores = dispatch.FAMILY.row(kind, example, Matrix(rock.rho0, rock.A, crush_quadratic.EXAMPLE.Pe))
    laws = (kind, pores, curve, crush_quadratic.EXAMPLE, 0, np.array(rock))
    rest = start = pores[0]
    low, turn, high = rock.rho0 / start, 0.81 * rock.rho0, 1.06 * rock.rho0
    for k, (a, b, words) in enumerate(
        (
            (low, turn, "loaded"),
            (turn, 0.985 * turn, "let go"),
            (0.985 * turn, high, "loaded again"),
            (high, rock.rho0, "let go"),
        )
    ):
        way = []
        for rho in np.linspace(a, b, 120):
            alpha, rest, *_ = dispatch.compact(*laws, rho, 0.0, rest, True)
            P = tillotson.pressure(alpha * rho, 0.0, rock) / alpha
            if P >= -1e6:
                way.append((rho, P, alpha))
        rho, P, alpha = np.array(way).T
        look = dict(color=f"C{k}", ls="-" if words.startswith("loaded") else "--", label=words)
        axes[0].plot(P / 1e6, alpha, **look)
        axes[1].plot(rho, P / 1e6, **look)
    axes[0].set(xlabel="pressure [MPa]", ylabel="distention", xlim=(-20, 1200))
    axes[1].set(xlabel="density with pores [kg/m$^3$]", ylabel="pressure [MPa]", ylim=(-20, 1200))
    axes[0].legend()
    crushing = "with the quadratic crush curve" if law.CRUSHES else "with its own curve"
    return (
        f"Basalt with the pores of the example in the file (alpha0 = {start:g}), {crushing}, cold: squeezed, let go, "
        "squeezed until no pore is left, let go. What is crushed stays crushed."
    )


def curve(law: ModuleType, axes: Any) -> str:
    """A crush curve and its slope."""
    kind = crush.FAMILY.kind(law.__name__.rpartition("crush_")[2])
    row = np.array(crush.FAMILY.row(kind, law.EXAMPLE), dtype=float)
    onset = crush.onset(kind, row)
    end = onset
    while crush.openness(kind, row, end) > 0.0:
        end *= 1.02
    P = np.geomspace(0.3 * onset, 1.5 * end, 400)
    axes[0].semilogx(P / 1e6, [crush.openness(kind, row, p) for p in P], "k")
    axes[1].loglog(P / 1e6, [-crush.slope(kind, row, p) * 1e6 for p in P], "k")
    for axis in axes:
        axis.axvline(onset / 1e6, color="0.6", ls=":", lw=1)
        axis.set(xlabel="pressure [MPa]")
    axes[0].set(ylabel=r"$(\alpha - 1)\,/\,(\alpha_s - 1)$")
    axes[1].set(ylabel="closing by pressure [1/MPa]")
    return (
        f"What is left of the pores against pressure, and how fast they close. Dotted: crushing starts at "
        f"{onset / 1e6:g} MPa. Values: the example in the file."
    )


def broken(law: ModuleType, axes: Any) -> str:
    """Damage against distention, alone and on top of damage by tension."""
    for k, start in enumerate((1.25, 1.5, 2.0)):
        alpha = np.linspace(1.0, start, 200)
        root = np.array([compaction_damage.root(a, start) for a in alpha])
        axes[0].plot(alpha, root**3, f"C{k}", label=f"alpha0 = {start:g}")
    axes[0].set(xlabel="distention", ylabel="damage by crushing", xlim=(2.0, 1.0))
    axes[0].legend()
    fraction = np.linspace(0.0, 1.0, 200)
    for k, before in enumerate((0.0, 0.01, 0.1)):
        roots = [
            compaction_damage.total(before ** (1 / 3), compaction_damage.root(1.5 - 0.5 * s, 1.5)) for s in fraction
        ]
        axes[1].plot(100 * fraction, np.array(roots) ** 3, f"C{k}", label=f"{before:g} by tension")
    axes[1].set(xlabel="pores closed [%]", ylabel="damage of both together")
    axes[1].legend()
    return (
        "Left: damage grows in proportion as the pores close. Right: with damage by tension before it, for cube roots "
        "add: rock that is 1 % broken is wholly broken before all its pores are gone."
    )


def waves(law: ModuleType, axes: Any) -> str:
    """Compaction waves in a porous material."""
    rows = collect(("pumice",)).rows
    speeds = np.geomspace(50.0, 4000.0, 16)
    found = [compaction_wave.driven(rows, 0, float(v)) for v in speeds]
    axes[0].loglog(speeds, [w.front.P / 1e6 for w in found], "k.-")
    axes[0].set(xlabel="piston speed [m/s]", ylabel="pressure behind the front [MPa]")
    axes[1].semilogx(speeds, [w.front.shock_speed for w in found], "k.-", label="front")
    pairs = [(v, w.precursor.shock_speed) for v, w in zip(speeds, found) if w.precursor]
    if pairs:
        axes[1].semilogx(*zip(*pairs), "C1.--", label="precursor")
    axes[1].set(xlabel="piston speed [m/s]", ylabel="speed of the wave [m/s]")
    axes[1].legend()
    right = axes[0].twinx()
    right.semilogx(speeds, [w.distention for w in found], "C0.-", ms=4)
    right.set_ylabel("distention behind it", color="C0")
    right.grid(False)
    return (
        "What a piston drives into pumice (the material that ships with bolide): pressure and distention behind the "
        "compaction front, and its speed, with that of the elastic precursor where the two run apart."
    )


def loading(law: ModuleType, axes: Any) -> str:
    """Speeds of the compaction wave and of sound along two crush curves."""
    rock = tillotson.EXAMPLE
    for k, pores in enumerate((p_alpha, strain_alpha)):
        kind, name = dispatch.FAMILY.laws.index(pores) + 1, pores.__name__.rpartition(".")[2].replace("_", "-")
        row = dispatch.FAMILY.row(kind, pores.EXAMPLE, Matrix(rock.rho0, rock.A, crush_quadratic.EXAMPLE.Pe))
        laws = kind, row, crush.FAMILY.kind("quadratic"), crush_quadratic.EXAMPLE, 0, np.array(rock)
        way = []
        for rho in np.linspace(rock.rho0 / row[0], rock.rho0, 200):
            alpha, _rest, f, unloading, _slow = dispatch.compact(*laws, rho, 0.0, row[0], True)
            P, d_rho, d_u = tillotson.pressure_and_derivatives(alpha * rho, 0.0, rock)
            heating = P / (alpha * rho) ** 2 * d_u
            if f < unloading:
                speed = max(law.squared(d_rho, heating, P / alpha, rho, f), 0.0) ** 0.5
                way.append((rho, alpha, speed, (d_rho + heating) ** 0.5))
        rho, alpha, speed, sound = np.array(way).T
        axes[0].plot(rho, speed, f"C{k}", label=name)
        axes[0].plot(rho, sound, f"C{k}--", lw=1)
        axes[1].plot(alpha, speed / sound, f"C{k}", label=name)
    axes[0].set(xlabel="density with pores [kg/m$^3$]", ylabel="speed [m/s]")
    axes[1].set(xlabel="distention", ylabel="compaction wave over sound", xlim=(1.5, 1.0))
    axes[0].legend()
    return (
        "Basalt with the pores of the examples in the files, cold, squeezed until no pore is left. Left: speed of the "
        "compaction wave (dashed: of sound). Right: one over the other."
    )


DRAWN = {
    "sph/porosity/loading_speed": loading,
    "sph/porosity/p_alpha": path,
    "sph/porosity/strain_alpha": path,
    "sph/porosity/crush_": curve,
    "sph/porosity/compaction_damage": broken,
    "sph/porosity/compaction_wave": waves,
}
