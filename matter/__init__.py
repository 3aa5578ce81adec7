"""The floor: what every stage stands on; it knows no stage and no case."""
