"""Stage 2: shock, damage and early flow by smoothed particle hydrodynamics."""
