"""Says when a stage compiles its kernels: a first run on a machine stands still for it, with nothing else to show.

Numba tells of every function that it compiles and is silent on what it loads from the cache
(``matter.compilation.jit``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

WORDS = "compiling kernels (first run only, 1-2 min; cached afterwards)"


@contextmanager
def told(say: Callable[[str], None]) -> Iterator[None]:
    """Give ``say`` the words when the first kernel is compiled inside this block, once."""
    from numba.core import event

    class Ear(event.Listener):
        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                self.said = True
                say(WORDS)

        def on_end(self, event: object) -> None:
            """Nothing."""

    with event.install_listener("numba:compile", Ear()):
        yield
