"""``python -m sph.eos``: runs ``sph.shock_states.eos_picture``, which stands on this folder."""

import runpy

runpy.run_module("sph.shock_states.eos_picture", run_name="__main__", alter_sys=True)
