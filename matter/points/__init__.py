"""Sets of points that fill regions and bodies."""
