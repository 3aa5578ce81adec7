"""Hugoniots, impedance matching and release from shocked states."""
