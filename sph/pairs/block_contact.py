"""What holds a block to the ground about it, or to another block: nothing. A pair across its surface passes on
compression and the shear that goes with it, and no tension.

    F_ij = 0 where  r . (sigma_i + sigma_j) . r > 0     (r the way between the two)

The same is left out of both partners' work, so that force and heat stay conjugate: momentum and total energy are kept
as of any pair. Matter on its own side bears what its material bears. Where the ground bears no tension by itself this
changes little: its particles have none to share.

Where the partners of such a pair part, the gap that opens between them is no expansion of either: their velocity
gradients see the partner move along. Otherwise a block in ground that flies apart would be stretched, and drawn
together, by what it does not touch.

Each particle says whose it is: -1 - b in block b, else the number of its material; pairs of ground and projectile are
no surface of a block. (Artificial conductivity reads the same number: heat flows within a block, and within
the ground.)
"""

from __future__ import annotations

import numpy as np

from matter.compilation.jit import law


@law
def cut(one, other, along):
    """1 where a pair passes nothing on, else 0; ``one`` and ``other`` whose the partners are, ``along`` r . (sigma_i +
    sigma_j) . r [Pa m^2]."""
    return 1.0 if one != other and min(one, other) < 0.0 and along > 0.0 else 0.0


def bodies(material: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Whose each particle is (n,), from its material and its block (n,)."""
    return np.where(block >= 0, -1 - block, material)
