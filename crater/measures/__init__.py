"""Diameter, depth, rim, volume and their errors from a surface."""
