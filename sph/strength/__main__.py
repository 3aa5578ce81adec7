"""``python -m sph.strength``: runs ``sph.shock_states.strength_picture``, which stands on this folder."""

import runpy

runpy.run_module("sph.shock_states.strength_picture", run_name="__main__", alter_sys=True)
