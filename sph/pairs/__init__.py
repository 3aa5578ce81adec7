"""Sums over pairs of neighbours: rates, gradients, smoothing."""
