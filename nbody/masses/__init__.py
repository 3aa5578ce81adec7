"""The massive bodies, their orbits, and the field in which a particle flies."""
