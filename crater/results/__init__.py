"""What the stage finds in a run, as tables and series."""
