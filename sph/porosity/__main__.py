"""``python -m sph.porosity``: runs ``sph.shock_states.porosity_picture``, which stands on this folder."""

import runpy

runpy.run_module("sph.shock_states.porosity_picture", run_name="__main__", alter_sys=True)
