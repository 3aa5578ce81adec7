"""Trials of grains whose outcome is known: a sheared cell, a column, a hopper, a heap, a carved bowl."""
