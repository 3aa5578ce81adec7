"""The runs behind the claims on the Ryugu shot by row: what they must show, and their arguments.

Rows S and G are of the shock stage, rows D and E of the grains; ``studies.sci`` makes and evaluates them.
"""

from __future__ import annotations

from typing import NamedTuple

from dem.engines import deviations
from studies.case_runs import sets


class Row(NamedTuple):
    """What must be shown, the runs by name (arguments of ``run_case``), and the times [s] at which shock stages are
    measured."""

    shows: str
    runs: dict[str, tuple[str, ...]]
    times: tuple[float, ...] = ()
    within: float = 0.0
    """Radius [m] inside which momentum and energy are summed instead of a crater measured."""
    after: float = 0.0
    """Time [s] from the start of the collapse at which the books of the grains are read."""


SPH, COARSE, QUICK = ("--until", "sph"), ("--preset", "coarse29"), ("--preset", "quick")
# the case computes a quarter (a vertical shot is its own mirror image in two planes) with reconstructed jumps; S2, S3
# and S5 have the former numerics beside them
QUARTER = (*SPH, *sets("sph.numerics=monaghan"))
WHOLE = (*QUARTER, *sets("sph.symmetry=none"))
FINE = sets(
    "sph.spacing_at_impact=6.5 cm",
    "sph.growth=0.04",
    "sph.spacing_far=1 m",
    "sph.end_time=1.2 s",
    "handoff.time=1.2 s",
)
EARLY = sets("sph.end_time=15.5 ms", "handoff.time=last", "sph.snapshot_interval=1 ms", "sph.history_interval=0.5 ms")
WIDE = sets('target.layers=[{name="soil",material="basalt",thickness="30 m"}]')
# one bed in the springs of the collapse for all engines, so that no contact carries an offset; D and depth at 200 s
SAME = (
    *QUICK,
    *sets("bed.largest_speed=0.025 m/s", "dem.springs_for=bed", "dem.end_time=200 s", "dem.latest_time=200 s"),
)
ACCEPT = "dem.accept=[" + ",".join(f'"{name}"' for name in deviations.SENTENCES) + "]"
NO_TWIST = sets("dem.contact.shell.twisting=0")
AT_15_MS = sets("sph.late.at=15 ms", "sph.late.sound_speed=20 m/s", "sph.late.viscosity_at=15 ms")
LATER = sets("sph.late.at=30 ms", "sph.late.sound_speed=20 m/s", "sph.late.viscosity_at=15 ms")
SLOWER = (*AT_15_MS, *sets('sph.late.slower=[{at="4 s",sound_speed="5 m/s"},{at="30 s",sound_speed="1 m/s"}]'))
ROWS = {
    "S1": Row(
        "switch at 15 and 30 ms, alpha halved and doubled: D 5 %, depth 10 % at 1 and 4 s",
        {
            "15 ms": (*SPH, *AT_15_MS),
            "30 ms": (*SPH, *LATER),
            "coarse": (*SPH, *COARSE, *AT_15_MS),
            "coarse 30 ms": (*SPH, *COARSE, *LATER),
            "coarse alpha / 2": (*SPH, *COARSE, *AT_15_MS, *sets("sph.late.alpha=0.05")),
            "coarse alpha x 2": (*SPH, *COARSE, *AT_15_MS, *sets("sph.late.alpha=0.2")),
        },
        (1.0, 4.0),
    ),
    "S2": Row(
        "Morris & Monaghan's switch from the start, and reconstructed jumps: ballistic D and V stated",
        {
            "none": (*QUARTER, *COARSE),
            "morris_monaghan": (*QUARTER, *COARSE, *sets("sph.viscosity_switch=morris_monaghan")),
            "reconstructed": (*SPH, *COARSE),
        },
        (1.0, 4.0, 6.0),
    ),
    "S3": Row(
        "three numbers of particles: ballistic D 5 %, V 10 % between the last two",
        {
            **{
                f"{words}{number}": (*kind, *size)
                for words, kind in (("", SPH), ("monaghan ", QUARTER))
                for number, size in (("29,532", COARSE), ("104,556", ()), ("227,512", FINE))
            },
        },
        (1.0,),
    ),
    "S4": Row(
        "ground of 22 and 30 m: vertical momentum and energy inside 5 m at 15 ms 10 %",
        {
            f"{depth} m, draw {draw}": (*SPH, *COARSE, *EARLY, *wide, *(sets(f"sph.seed={draw}") if draw > 1 else ()))
            for draw in (1, 2, 3)
            for depth, wide in ((22, ()), (30, WIDE))
        },
        (0.015,),
        5.0,
    ),
    "S5": Row(
        "a quarter against the whole, each with a draw of its own: D and depth within the scatter",
        {
            "whole": WHOLE,
            "quarter": QUARTER,
            "coarse whole": (*WHOLE, *COARSE),
            "coarse quarter": (*QUARTER, *COARSE),
        },
        (1.0, 4.0),
    ),
    "S6": Row(
        "a quarter whose projectile has 4 (one in each quarter), 16 and 56 particles: D and depth stated",
        {f"{count}": (*SPH, *QUICK, *sets(f"sph.projectile_particles={count}")) for count in (1, 16, 50)},
        (1.0, 4.0, 8.0),
    ),
    "G": Row(
        "what the stand-ins for Ryugu's ground decide, on the preset quick: D, depth and what flies freely stated",
        {
            name: (*SPH, *QUICK, *sets(f"sph.materials.basalt.{law}"))
            for name, law in (
                ("friction 25 deg", 'drucker_prager={friction_angle="25 deg"}'),
                ("friction 35 deg", 'drucker_prager={friction_angle="35 deg"}'),
                ("44 % pores", "p_alpha={alpha0=1.8}"),
                ("crushes from 10 kPa", 'crush_quadratic={Pe="10 kPa",Ps="1.5 GPa"}'),
                ("crushes from 1 MPa", 'crush_quadratic={Pe="1 MPa",Ps="1.5 GPa"}'),
                ("solid at 0.5 GPa", 'crush_quadratic={Pe="0.1 MPa",Ps="0.5 GPa"}'),
            )
        }
        | {"quick": (*SPH, *QUICK)},
        (1.0, 4.0, 8.0),
    ),
    "D1": Row(
        "random packing, one handoff: 50,000 to 100,000 grains D 5 %, depth 10 % and r / 2",
        {f"{count:,}": sets(f"bed.count={count}") for count in (20_000, 50_000, 100_000)},
    ),
    "D2": Row(
        "hexagonal packing: D below 0.95, depth below 0.9 of the random one, its change with the number larger",
        {
            **{f"hcp {count:,}": ("--preset", "hcp", *sets(f"bed.count={count}")) for count in (50_000, 100_000)},
            "tilted 50,000": sets("bed.packing=hcp_tilted", "bed.count=50000"),
        },
    ),
    "D3": Row("against the observation: D 14.5-16.7, depth 2.07-2.99, rim 16.2-19.8 m", {"case": ()}),
    "D5": Row(
        "springs four times as stiff D 3 %, depth 5 %; half and twice the time of the handoff, limits of 0.5 "
        "and 2 m/s D 5 %, depth 10 %; "
        "three beds: the scatter is the error (inspect_handoff RUN --sensitivity does the rest)",
        {
            "quick": QUICK,
            "springs x 4": (*QUICK, *sets("dem.springs_for=0.05 m/s")),
            "bed 2": (*QUICK, *sets("bed.seed=2")),
            "bed 3": (*QUICK, *sets("bed.seed=3")),
            "4 s": (*QUICK, *sets("handoff.time=4 s")),
            "limit 0.5 m/s": (*QUICK, *sets("handoff.speed_limit=0.5 m/s")),
            "limit 2 m/s": (*QUICK, *sets("handoff.speed_limit=2 m/s")),
            "16 s": (*QUICK, *sets("handoff.time=16 s", "sph.end_time=16 s")),
        },
    ),
    "D6": Row(
        "bowls of 18 to 26 m, 0.39 m the grains about the crater, two beds each: 18 to 22 m D 3 %, depth 5 %",
        {
            f"{radius} m, bed {seed}": (
                *QUICK,
                *sets(f"bed.arc_radius={radius} m", f"bed.count={count}", f"bed.seed={seed}"),
            )
            for seed in (1, 2)
            for radius, count in ((18, 17_700), (22, 21_100), (26, 25_700))
        },
    ),
    "D7": Row(
        "1 Pa of cohesion: smaller",
        {"none": QUICK, "1 Pa": (*QUICK, *sets("dem.contact.cohesion=zhang", "dem.contact.shell.cohesion=1 Pa"))},
    ),
    "D9": Row(
        "the same all in SPH, to 20 s at one sound speed, and to 500 s at lower ones from 4 and 30 s on",
        {
            "20 s": (*SPH, *QUICK, *sets("sph.end_time=20 s")),
            "500 s": (
                *SPH,
                *QUICK,
                *SLOWER,
                # ground that carries no weight would sink into the quiet layer, by 0.5 m in this time
                *sets("sph.end_time=500 s", "sph.snapshot_interval=4 s", "target.start=relaxed"),
            ),
        },
        (4.0, 8.0, 20.0, 100.0, 500.0),
    ),
    "E": Row(
        "other engines from one bed: momentum and energy lost by 10 s 2 %, D and depth within twice the scatter of "
        "three beds",
        {
            "native": SAME,
            "lammps": (*SAME, *sets("dem.engine=lammps", ACCEPT)),
            "native, no twist": (*SAME, *NO_TWIST),
            "liggghts, no twist": (*SAME, *NO_TWIST, *sets("dem.engine=liggghts", ACCEPT)),
        },
        after=10.0,
    ),
}
