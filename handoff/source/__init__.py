"""The shock stage's cloud as the handover sees it: surface, cavity, pressure, time."""
