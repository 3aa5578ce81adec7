"""From an observed crater to what made it: emulator of a sweep, posterior, page."""
