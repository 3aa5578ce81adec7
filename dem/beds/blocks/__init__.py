"""Blocks in a bed: large grains that are in place first, and the ground that settles round them."""
