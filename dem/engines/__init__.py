"""The collapse on other engines: LAMMPS and LIGGGHTS, one module each, and what both share."""
