"""``run_case`` with the real stages and a checkpoint every fraction of a second, so that a small run has some to be
killed between."""

import dem.collapse
import sph.simulation
from pipeline import cli

sph.simulation.CHECKPOINT_WALL = 0.2
dem.collapse.CHECKPOINT_EVERY_S = 0.1

if __name__ == "__main__":
    cli.run_case()
