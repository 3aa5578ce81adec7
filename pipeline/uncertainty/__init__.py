"""Errors and sensitivities of a whole run, and frozen forecasts."""
