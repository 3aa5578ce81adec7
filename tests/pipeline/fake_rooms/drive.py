"""``run_case`` with the fake stages in place of the real ones, for tests that need a process of its own."""

from pipeline import cli
from pipeline.case import stages
from pipeline.running import run_process

stages.MODULES.update({stage: f"fake_{stage}" for stage in stages.ORDER})
run_process._COMMAND = "import drive; drive.cli.run_case()"  # so do the processes that it starts

if __name__ == "__main__":
    cli.run_case()
