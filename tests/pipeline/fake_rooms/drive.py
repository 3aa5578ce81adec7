"""``run_case`` with the fake stages in place of the real ones, for tests that need a process of its own."""

from pipeline import cli, stages

stages.MODULES.update({stage: f"fake_{stage}" for stage in stages.ORDER})

if __name__ == "__main__":
    cli.run_case()
