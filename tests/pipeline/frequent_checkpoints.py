"""``run_case`` with the real stages and a checkpoint every fraction of a second, so that a small run has some to be
killed between."""

from matter import cadence
from pipeline import cli

cadence.SHARE = 1.0
cadence.set_pace(cadence.Pace(0.1))

if __name__ == "__main__":
    cli.run_case()
