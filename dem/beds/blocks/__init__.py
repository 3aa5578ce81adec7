"""Blocks in a bed of flat ground: large grains that go in first, and the ground that settles round them."""
