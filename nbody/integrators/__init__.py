"""Ways to bring a test particle from the edge of Jupiter's Hill sphere to a moon: one file each."""
