"""Constants of nature."""

G = 6.6743e-11
"""Newton's constant of gravitation [m^3/(kg s^2)] (CODATA 2018)."""
