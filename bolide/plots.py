"""Pictures of a run for a notebook."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Plots:
    """What can be drawn of a run called ``name``; ``table`` gives the profile of a crater."""

    table: Callable[[str], pandas.DataFrame]
    name: str

    def profile(self, stage: str = "final", axes: Axes | None = None) -> Axes:
        """Height against radius with its band over azimuth, in km, or in m where the profile ends before 2 km; drawn
        into ``axes``, in the unit that they have, or into a new figure. Raises ``InputError`` as ``Run.profile``."""
        from matter.wording import drawing

        drawing.require("a picture")
        import matplotlib.pyplot as plt

        table = self.table(stage)
        if axes is None:
            axes = plt.figure(figsize=(7.0, 3.5), layout="constrained").add_subplot()
        drawn = axes.get_xlabel()
        large = drawn.endswith("[km]") if drawn.endswith("m]") else table["radius_m"].max() >= 2e3
        factor, unit = (1e-3, "km") if large else (1.0, "m")
        radius = factor * table["radius_m"]
        (line,) = axes.plot(radius, factor * table["height_m"], label=f"{self.name}, {stage.replace('_', ' ')}")
        axes.fill_between(
            radius,
            factor * table["height_p16_m"],
            factor * table["height_p84_m"],
            color=line.get_color(),
            alpha=0.25,
            linewidth=0.0,
        )
        axes.set(xlabel=f"distance along the datum [{unit}]", ylabel=f"height above the datum [{unit}]")
        axes.legend()
        return axes
