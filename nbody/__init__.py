"""Stage 1: who hits whom, how fast, at which angle."""
