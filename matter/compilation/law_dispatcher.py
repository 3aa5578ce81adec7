"""Laws and inner loops as kernels take them in: compiled without the code that only a call from outside needs.

numba gives each compiled function two wrappers, one for Python and one for C. Kernels take a law into their own code
and call neither, yet a good part of the time that a small law takes to compile goes into them; of a loop that takes
tuples of forty arrays they are longer than the loop. A law and an inner kernel therefore have none. Where Python calls
one, that call compiles it once more, with its wrapper. numba compiles the body of each ``prange`` as a function of its
own, which only its scheduler calls: ``leave_out_wrappers_of_loop_bodies``.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba.core.registry import CPUDispatcher
from numba.parfors import parfor_lowering

NO_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


class Law(CPUDispatcher):
    """A law for kernels; ``compiled`` makes of a plain function one that Python may call."""

    def __init__(
        self, py_func: FunctionType, compiled: Callable[[FunctionType], Any] | None = None, **usual: Any
    ) -> None:
        super().__init__(py_func, **usual)
        self._compiled = compiled

    @functools.cached_property
    def for_python(self) -> Any:
        """The same law with the wrapper that a call from Python needs, under a name of its own in the cache."""
        law = self.py_func
        twin = FunctionType(law.__code__, law.__globals__, law.__name__, law.__defaults__, law.__closure__)
        twin.__kwdefaults__, twin.__module__ = law.__kwdefaults__, law.__module__
        twin.__qualname__ = f"{law.__qualname__}_for_python"
        assert self._compiled is not None, f"{law.__qualname__} came out of a cache: only kernels may call it"
        return self._compiled(twin)

    def __call__(self, *values: Any, **named: Any) -> Any:
        return self.for_python(*values, **named)


def law(function: FunctionType, compiled: Callable[[FunctionType], Any], **options: Any) -> Law:
    """The ``function`` as a law, with numba's ``options``; Python's calls go to ``compiled(function)``."""
    return Law(function, compiled, targetoptions={"nopython": True, "boundscheck": None, **options, **NO_WRAPPERS})


def leave_out_wrappers_of_loop_bodies() -> None:
    """From here on numba compiles the bodies of ``prange`` loops without wrappers. A numba that has no such function
    keeps them."""
    make: Any = getattr(parfor_lowering, "_create_gufunc_for_parfor_body", None)
    if make is None or getattr(make, "leaves_out_wrappers", False):
        return

    @functools.wraps(make)
    def make_bare(lowerer: Any, parfor: Any, typemap: Any, typing: Any, target: Any, flags: Any, *more: Any) -> Any:
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True  # a copy, this body's own
        return make(lowerer, parfor, typemap, typing, target, flags, *more)

    make_bare.leaves_out_wrappers = True  # type: ignore[attr-defined]
    parfor_lowering._create_gufunc_for_parfor_body = make_bare
