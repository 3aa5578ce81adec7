"""Sweeps of a case, their members, jobs and tables."""
