"""Running a settling to its end, from a checkpoint where there is one."""

from __future__ import annotations

from pathlib import Path

from dem.beds.settling import Settling
from dem.grains.assembly import Assembly
from matter.cadence import Cadence
from matter.files import checkpoint
from matter.progress import Progress, stop_here


def finish(work: Settling, out: Path) -> tuple[Assembly, dict[str, float]]:
    """Run a settling until the bed's rms speed over sqrt(g r) stays below its limit, from a checkpoint in ``out``
    if there is one.

    Returns the bed and facts on how it got there: ``steps``, and ``free_run_speed``, the rms speed over sqrt(g r)
    after a travel time without any damping.
    """
    saved = checkpoint.newest(out)
    if saved is not None:
        work.restore(*saved)
    progress = Progress("bed", sum(p.length for p in work.plan), start=work.progress)
    cadence = Cadence()
    while True:
        while work.done < work.steps:
            work.step()
            progress.update(work.progress, f"{work.plan[work.phase].name}: {work.bed.speed:.3g} m/s")
            if cadence.due():
                with cadence.writing():
                    work.save(out)
                stop_here("bed")
        if not work.next():
            break
    return work.result(), {"steps": float(work.total), "free_run_speed_over_sqrt_g_r": work.free_speed}
