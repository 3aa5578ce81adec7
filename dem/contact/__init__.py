"""The contact of two grains or of a grain and a wall, and its settings."""
