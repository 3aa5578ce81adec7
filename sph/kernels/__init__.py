"""Smoothing kernels, one a file."""
