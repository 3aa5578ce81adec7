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
        """Height against radius [km] with its band over azimuth; drawn into ``axes``, or into a new figure. Raises
        ``InputError`` as ``Run.profile``."""
        from matter import drawing

        drawing.require("a picture")
        import matplotlib.pyplot as plt

        table = self.table(stage)
        if axes is None:
            axes = plt.figure(figsize=(7.0, 3.5), layout="constrained").add_subplot()
        radius = 1e-3 * table["radius_m"]
        (line,) = axes.plot(radius, 1e-3 * table["height_m"], label=f"{self.name}, {stage.replace('_', ' ')}")
        axes.fill_between(
            radius,
            1e-3 * table["height_p16_m"],
            1e-3 * table["height_p84_m"],
            color=line.get_color(),
            alpha=0.25,
            linewidth=0.0,
        )
        axes.set(xlabel="distance along the datum [km]", ylabel="height above the datum [km]")
        axes.legend()
        return axes
