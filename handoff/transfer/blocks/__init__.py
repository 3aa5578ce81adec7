"""Blocks at the handover: whole ones as one grain each, the ground of the others."""
