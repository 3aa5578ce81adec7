"""Mass, momentum and ejecta from particles to grains."""
