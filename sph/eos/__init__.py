"""Equations of state, one law a file."""
