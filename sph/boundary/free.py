"""A free surface: nothing ends the ground, and nothing holds it."""

WORDS = "nothing at all"
TAKES_MOMENTUM, FLOOR = False, True
