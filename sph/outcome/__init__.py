"""What the stage reports at its end: energy, escape, fragments."""
