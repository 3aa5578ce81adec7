"""Stage 6: measuring the crater and comparing it."""
