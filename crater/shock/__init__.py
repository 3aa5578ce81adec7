"""What the shock leaves behind: decay of its pressure, melt and vapour, release."""
