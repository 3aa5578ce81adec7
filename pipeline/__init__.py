"""The roof: case files, order of stages, resume, commands; no physics."""
