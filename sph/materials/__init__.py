"""Material laws and their settings, by material of a particle."""
