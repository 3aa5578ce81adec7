"""Pictures of equations of state, strength and damage, each from the law's own functions and its example values."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from matter.case import material
from sph.damage import grady_kipp, growth
from sph.eos import ideal_gas, murnaghan, tillotson
from sph.materials.rows import collect
from sph.shock_states import hugoniot, impedance
from sph.strength import block_model, inertial_friction, thermal_softening, von_mises
from sph.strength import dispatch as strength

GREY = "0.7"


def _held(law: ModuleType) -> Any:
    """What the law's functions take for its example: its values, or its row where it reads a bare one."""
    return law.row(law.EXAMPLE) if getattr(law, "Row", law.EXAMPLE) is None else law.EXAMPLE


def _rest(law: ModuleType) -> hugoniot.State:
    """The law's example at rest; a gas, which has no cold state, at 0.1 MJ/kg."""
    rho0, p = law.EXAMPLE.rho0, _held(law)
    u = 1e5 if law.modulus(p) == 0.0 else 0.0
    return hugoniot.State(rho0, u, law.pressure_and_derivatives(rho0, u, p)[0], 0.0)


def _shocked(law: ModuleType, speeds: np.ndarray) -> list[hugoniot.State]:
    """States behind shocks into the law's example at rest, as far as the jump conditions can be met."""
    p, states = _held(law), []
    for speed in speeds:
        try:
            states.append(
                hugoniot.behind(lambda rho, u: law.pressure_and_derivatives(rho, u, p)[0], _rest(law), float(speed))
            )
        except ValueError:
            break
    return states


def equation_of_state(law: ModuleType, axes: Any) -> str:
    """Isotherms of energy and the Hugoniot; shock speed against particle speed."""
    rho0, p = law.EXAMPLE.rho0, _held(law)
    solid = law.modulus(p) > 0.0
    speeds = np.geomspace(50.0, 10e3 if solid else 3e3, 24)
    states = _shocked(law, speeds)
    rho, P, us, up = (np.array([getattr(s, key) for s in states]) for key in ("rho", "P", "shock_speed", "v"))
    unit, word = (1e9, "GPa") if P.max() > 1e8 else (1e6, "MPa")
    grid = np.linspace(0.5 if solid else 0.2, 1.05 * rho.max() / rho0, 200) * rho0
    lowest = P.max()
    for energy in sorted({_rest(law).u, *(states[k].u for k in (len(states) // 2, -6, -1))}):
        cold = [law.pressure_and_derivatives(r, energy, p)[0] / unit for r in grid]
        lowest = min(lowest, *cold)
        axes[0].plot(grid, cold, lw=1, label=f"u = {energy / 1e6:.3g} MJ/kg")
    axes[0].plot(rho, P / unit, "k.-", ms=4, lw=1, label="Hugoniot")
    axes[0].set(xlabel="density [kg/m$^3$]", ylabel=f"pressure [{word}]")
    axes[0].set_ylim(max(lowest, -0.1 * P.max() / unit), 1.05 * P.max() / unit)
    axes[0].legend()
    axes[1].plot(up / 1e3, us / 1e3, "k.-", ms=4, lw=1)
    axes[1].set(xlabel="particle speed [km/s]", ylabel="shock speed [km/s]")
    return (
        f"Left: pressure against density at the energies named, and the states behind shocks into matter at rest "
        f"(black). Right: the speed of those shocks. Values: the example in the file, rho0 = {rho0:g} kg/m^3."
    )


def shocks(law: ModuleType, axes: Any) -> str:
    """Shock states of three laws by the same function."""
    for name, one, limit in (
        ("basalt (Tillotson)", tillotson, 10e3),
        ("soil (Murnaghan)", murnaghan, 10e3),
        ("air (ideal gas)", ideal_gas, 3e3),
    ):
        states = _shocked(one, np.geomspace(20.0, limit, 30))
        speed = np.array([s.v for s in states]) / 1e3
        axes[0].loglog(speed, [s.P for s in states], label=name)
        axes[1].semilogx(speed, [s.rho / _rest(one).rho for s in states], label=name)
    axes[0].set(xlabel="particle speed [km/s]", ylabel="pressure [Pa]")
    axes[1].set(xlabel="particle speed [km/s]", ylabel="compression rho / rho0")
    axes[1].axhline(6.0, color=GREY, ls=":", lw=1)
    axes[0].legend()
    return (
        "Pressure and compression behind a shock, solved by this file on three equations of state; dotted: the "
        "limit (gamma + 1) / (gamma - 1) = 6 of the gas. A law whose pressure takes no heat ends where no state "
        "obeys the jump conditions."
    )


def plates(law: ModuleType, axes: Any) -> str:
    """The match of two plates, and its pressure against the speed."""
    pairs = (("iron", "basalt"), ("basalt", "basalt"), ("ice", "basalt"), ("ice", "ice"))
    materials = collect(("iron", "basalt", "ice"))
    speed = 5e3
    w = np.linspace(100.0, speed - 100.0, 30)
    for name, side, towards in (("basalt, hit", "basalt", w), ("iron, hits at 5 km/s", "iron", speed - w)):
        pressure, rest = hugoniot.solid(materials.rows, materials.index(side))
        axes[0].plot(w / 1e3, [hugoniot.behind(pressure, rest, float(v)).P / 1e9 for v in towards], label=name)
    match = impedance.planar(materials, "iron", "basalt", speed)
    axes[0].plot(match.speed / 1e3, match.pressure / 1e9, "ko", ms=5)
    axes[0].annotate(f"  {match.pressure / 1e9:.0f} GPa", (match.speed / 1e3, match.pressure / 1e9))
    axes[0].set(xlabel="speed of the contact [km/s]", ylabel="pressure [GPa]")
    axes[0].legend()
    speeds = np.linspace(1e3, 20e3, 12)
    for pair in pairs:
        axes[1].plot(
            speeds / 1e3,
            [impedance.planar(materials, *pair, float(v)).pressure / 1e9 for v in speeds],
            label=f"{pair[0]} on {pair[1]}",
        )
    axes[1].set(xlabel="impact speed [km/s]", ylabel="planar limit [GPa]")
    axes[1].legend()
    return (
        "Left: both sides of a contact share one pressure and one speed: the Hugoniots of target and projectile "
        "cross there. Right: that pressure against the speed of impact, for plates of materials that ship with bolide."
    )


def yield_law(law: ModuleType, axes: Any) -> str:
    """The yield surface by damage, and its softening."""
    kind = next(k for k in range(1, len(strength.FAMILY.names)) if strength.FAMILY.module(k) is law)
    p: Any = law.EXAMPLE
    row = np.zeros(strength.FAMILY.width)
    held = strength.FAMILY.row(kind, p)
    row[: len(held)] = held
    whole = strength.FAMILY.having("MIXES_DAMAGE")[kind]
    most = 3e9 if strength.yield_stress(kind, row, 1e9, 0.0, 0.0) > 5e7 else 1e7
    top = 10e6 if strength.yield_stress(kind, row, 0.0, 0.0, 0.0) < 1e7 and not hasattr(law, "intact") else most
    grid = np.linspace(-0.15 * top, top, 200)
    unit, word = (1e9, "GPa") if top > 1e8 else (1e6, "MPa")
    for D in (0.0, 0.5, 1.0):
        fraction = 1.0 if whole else 1.0 - D
        limits = [fraction * strength.yield_stress(kind, row, P, 0.0, D) / unit for P in grid]
        axes[0].plot(grid / unit, limits, label=f"D = {D:g}")
    axes[0].set(xlabel=f"pressure [{word}]", ylabel=rf"$\sqrt{{3 J_2}}$ at yield [{word}]")
    axes[0].legend(title="damage")
    melt = p.melt_energy if np.isfinite(p.melt_energy) else 3.4e6
    row_hot = row.copy()
    hot = strength.FAMILY.row(kind, p._replace(melt_energy=melt))
    row_hot[: len(hot)] = hot
    heat = np.linspace(0.0, 1.2 * melt, 100)
    axes[1].plot(heat / 1e6, [strength.yield_stress(kind, row_hot, 0.3 * top, u, 0.0) / unit for u in heat], "k")
    axes[1].set(xlabel="specific energy [MJ/kg]", ylabel=rf"$\sqrt{{3 J_2}}$ at yield [{word}]")
    return (
        "Left: the limit of the shear stress against pressure, cold, for whole, half broken and broken matter. "
        f"Right: its softening towards the melt energy ({melt / 1e6:g} MJ/kg), whole, at {0.3 * top / unit:g} {word}. "
        "Values: the example in the file."
    )


def inertial(law: ModuleType, axes: Any) -> str:
    """The factor of the friction against the inertial number, and that number against the rate."""
    p = inertial_friction.Parameters(1.0)
    I = np.logspace(-3, 1.5, 200)
    for name, half, ratio in (("glass beads", p.I0, p.ratio), ("grains of friction 0.302", 1.65, 2.13)):
        axes[0].semilogx(I, [inertial_friction.factor(v, half, ratio) for v in I], label=name)
    axes[0].set(xlabel="inertial number I", ylabel=r"$\mu(I)\,/\,\mu_s$")
    axes[0].legend()
    rates = np.logspace(-4, 0, 100)
    for P in (1.0, 100.0, 1e4):
        shear = (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)
        numbers = [inertial_friction.inertial_number(*(v * e for e in shear), 1.0, 3000.0, P) for v in rates]
        axes[1].loglog(rates, numbers, label=f"{P:g} Pa")
    axes[1].set(xlabel="rate of shear [1/s]", ylabel="I of grains of 1 m, 3,000 kg/m$^3$")
    axes[1].legend(title="pressure")
    return (
        "Left: friction over that of slow flow, for glass beads (the default) and for the grains of the late stage, "
        "measured. Right: what makes I large: fast shear, large grains, little pressure."
    )


def shaking(law: ModuleType, axes: Any) -> str:
    """How the vibration dies away, and the friction that it leaves."""
    time = np.linspace(0.0, 480.0, 200)
    for gamma_beta in (50.0, 100.0, 200.0):
        p = block_model.row(block_model.Parameters(1e-3, gamma_beta), 7000.0)
        decay = 3000.0 * p.decay_time
        speeds = [block_model.next_speed(p.v_max, t, p.t_off + t, 0.0, False, *p[:3], decay) for t in time]
        axes[0].plot(time, speeds, label=f"{gamma_beta:g}")
    axes[0].set(xlabel="time after the shock [s]", ylabel="vibration [m/s]")
    axes[0].legend(title="gamma_beta")
    P = np.linspace(0.0, 1e9, 200)
    for v_vib in (0.0, 5.0, 20.0, 50.0):
        left = [0.6 * (one - block_model.pressure(v_vib, one, 3000.0, 7000.0)) / 1e6 for one in P]
        axes[1].plot(P / 1e6, left, label=f"{v_vib:g} m/s")
    axes[1].set(xlabel="pressure [MPa]", ylabel="friction that is left [MPa]")
    axes[1].legend(title="vibration")
    return (
        "Left: the vibration that a shock leaves (200 m/s) after a projectile of 3 km radius. Right: what it takes "
        "from a friction of 0.6 in broken rock of 3,000 kg/m$^3$ and 7 km/s: none is left up to the pressure of the "
        "vibration. What flow adds is not drawn."
    )


def softening(law: ModuleType, axes: Any) -> str:
    """The factor, and what it makes of a yield stress."""
    x = np.linspace(-0.2, 1.5, 100)
    axes[0].plot(x, [thermal_softening.softening(v, 1.0) for v in x], "k")
    axes[0].set(xlabel="u / u_melt", ylabel="factor of the yield stress")
    heat = np.linspace(0.0, 5e6, 200)
    for name in ("basalt", "ice", "copper"):
        p = von_mises.Parameters(**material.section(name, "von_mises"))
        axes[1].plot(heat / 1e6, [von_mises.yield_stress(0.0, u, 0.0, p) / 1e9 for u in heat], label=name)
    axes[1].set(xlabel="specific energy [MJ/kg]", ylabel="yield stress [GPa]")
    axes[1].legend()
    return (
        "Left: the factor against energy over melt energy. Right: what it makes of the yield stress of von Mises in "
        "materials that ship with bolide."
    )


def flaws(law: ModuleType, axes: Any) -> str:
    """Flaws dealt out, beside the distribution that they follow."""
    p = grady_kipp.Parameters(4e35, 9.0)
    volumes = np.full(2000, 1e-6)
    start, strains = grady_kipp.flaws(volumes, p, np.random.default_rng(1))
    eps = np.sort(strains)
    axes[0].loglog(eps, np.arange(1, len(eps) + 1) / volumes.sum(), label="dealt out")
    axes[0].loglog(eps, p.k * eps.astype(float) ** p.m, "k:", label="k eps^m")
    axes[0].set(xlabel="strain", ylabel="open flaws [1/m$^3$]")
    axes[0].legend()
    count = np.diff(start)
    axes[1].hist(count, bins=np.arange(count.max() + 2) - 0.5, color="C0")
    axes[1].axvline(grady_kipp.expected(volumes) / len(volumes), color="k", ls=":")
    axes[1].set(xlabel="flaws of a particle", ylabel="particles")
    return (
        "Left: flaws that open below a strain, as dealt out to 2,000 particles of 1 cm^3, on the Weibull law (k = "
        "4e35 per m^3, m = 9). Right: how many each particle has; dotted: ln n + 0.6."
    )


def damage_growth(law: ModuleType, axes: Any) -> str:
    """Rate and damage of one law, the others in grey."""
    total, radius, support, speed = 20, 10.0, 32.0, 1500.0
    least, most = 1e-4, 3e-4
    opens = least * np.arange(1, total + 1) ** (np.log(most / least) / np.log(total))
    time = np.linspace(0.0, 0.05, 400)
    for kind in sorted(range(1, len(growth.FAMILY.names)), key=lambda k: growth.FAMILY.module(k) is law):
        own = growth.FAMILY.module(kind) is law
        look = dict(
            color="k" if own else GREY, lw=1.8 if own else 1.0, label=growth.FAMILY.names[kind] if own else None
        )
        root, damage, rates = 0.0, [], []
        for t in time:
            strain = 8e-3 * t
            opened = int(np.searchsorted(opens, strain, side="right"))
            counted = growth.counted(kind, opened, total, strain, least, most)
            fast = growth.crack_speed(kind, speed, 2.67e10, 2.27e10, 2700.0, root**3)
            rate = growth.rate(kind, *counted, fast, radius, support)
            rates.append(rate)
            root = max(root, min(root + rate * (time[1] - time[0]), growth.cap(kind, *counted)))
            damage.append(root**3)
        axes[0].plot(8e-3 * time * 1e3, np.array(rates), **look)
        axes[1].plot(time * 1e3, damage, **look)
    axes[0].set(xlabel="strain [1e-3]", ylabel="d(D$^{1/3}$)/dt [1/s]", yscale="symlog")
    axes[1].set(xlabel="time [ms]", ylabel="damage D")
    axes[1].legend()
    return (
        "A particle with 20 flaws that open between strains of 1e-4 and 3e-4, stretched at 8e-3 per second: how fast "
        "damage may grow, and how it grows. Black: this law; grey: the other laws of the family."
    )


DRAWN = {
    "sph/eos/": equation_of_state,
    "sph/eos/hugoniot": shocks,
    "sph/eos/impedance": plates,
    "sph/strength/": yield_law,
    "sph/strength/thermal_softening": softening,
    "sph/strength/inertial_friction": inertial,
    "sph/strength/block_model": shaking,
    "sph/damage/grady_kipp": flaws,
    "sph/damage/growth_": damage_growth,
}
