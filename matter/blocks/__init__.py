"""Blocks in the ground: how large they are, where they lie, and the file that tells all stages."""
