"""Published numbers of the three impacts (Winter 2017, chapter 3)."""

from __future__ import annotations

MPD = {"350": 26e3, "600": 51e3, "980": 51e3}
"""Published errors of the depth, half a smoothing length [m]."""
DIAMETER = {"350": (350e3, 52e3, 52e3), "600": (600e3, 102e3, 102e3), "980": (980e3, 177e3, 273e3)}
DEPTH = {"350": 75e3, "600": 225e3, "980": 300e3}
SPEEDS = (19.99e3, 18.234e3, 14.1e3, 9.59e3)
"""v1 is 19.89 km/s in the text; Table 9 was made with 19.99 km/s."""
RADII = {"350": (24.69, 26.25, 31.16, 40.29), "600": (47.0, 49.0, 58.16, 75.2), "980": (50.71, 53.9, 63.98, 82.72)}
MASSES = {
    "350": (5.78, 6.95, 11.62, 25.11),
    "600": (37.62, 45.19, 75.58, 163.37),
    "980": (50.08, 60.15, 100.6, 217.45),
}
RATIOS = {"350": (0.14, 0.15, 0.18, 0.23), "600": (0.15, 0.16, 0.19, 0.25), "980": (0.1, 0.11, 0.13, 0.17)}
ICE = 917.0
PUBLISHED_TIME = 16.8 * 60.0
