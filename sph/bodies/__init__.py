"""Target, projectile and the particles that fill them."""
