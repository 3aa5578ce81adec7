"""Figures, sections through a run, movies and turning views: how a crater is drawn."""
