"""Resolution, durations and strength of the ground before a run."""
