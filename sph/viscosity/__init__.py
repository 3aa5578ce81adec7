"""Artificial viscosity, one scheme a file."""
