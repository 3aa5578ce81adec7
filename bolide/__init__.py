"""bolide from Python: run a case, open a run, look at what came out.

    import bolide

    run = bolide.run("cases/valhalla_980km", preset="quick", **{"impact.speed": "15 km/s"})
    run = bolide.open("runs/valhalla_980km-1a2b3c4d")
    run.measures["final"]["depth_m"]          # Value(value=..., sigma=..., unit="m")
    run.profile("final"), run.history("sph")  # pandas, units in their attrs
    run.snapshot("10 min").position           # arrays, or form="pyvista"
    bolide.sweep("cases/valhalla_980km", {"dem.contact.shell.friction": [0.3, 0.5, 0.7]}, preset="quick")

The rooms of the project (``sph``, ``dem``, ``crater`` ...) lie beside this package and can be imported too; users need
this one alone. Importing it is quick: what computes or draws is imported when it is asked for.
"""

from bolide.files import import_snapshot
from bolide.forecasts import score
from bolide.inversion import Posterior, invert
from bolide.runs import Run, open, run
from bolide.sweeps import sweep
from bolide.tables import materials, scaling
from bolide.values import Value
from matter.errors import InputError, Stopped, UnphysicalState, Unsound

__all__ = [
    "InputError",
    "Posterior",
    "Run",
    "Stopped",
    "UnphysicalState",
    "Unsound",
    "Value",
    "import_snapshot",
    "invert",
    "materials",
    "open",
    "run",
    "scaling",
    "score",
    "sweep",
]
