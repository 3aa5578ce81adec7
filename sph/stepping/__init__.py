"""Time integration: state, rates, time steps, boundaries."""
