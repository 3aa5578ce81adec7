"""The grains of a run, their list of pairs, forces and time integration."""
