"""Where grains lie and how a bed is made: the ground, its container or domain, packing, settling, and what a bed is
like."""
