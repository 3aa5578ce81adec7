"""Machine code that follows from the source alone: not from which process compiled it, nor from what else is loaded.

Two habits of numba (seen in 0.68) are mended here.

**Linking.** Compiling a function, numba links into its library a copy of all that it calls, among them the body of
each ``prange`` loop, which it has already compiled as a library of its own; then it optimises the whole once more. The
copies are weak symbols, and the linker in the process takes for a weak symbol the first definition that it finds. So a
process that compiles a parallel kernel runs the body that was optimised once, while a process that loads the same
kernel from the cache finds only the copy that was optimised twice: in a pair loop with ``fastmath`` their sums differ
in the last bit. Likewise what one kernel calls could come out of another that was loaded before it; and bodies of
loops carry the address of a Python object in their name, so that two kernels compiled by two processes may hold
different bodies of one name. ``keep_copies_private`` turns the copies into local symbols, just before machine code is
made: every kernel then runs what is in its own file of the cache.

**Closures.** The cache finds a closure by what its cells hold, pickled; a compiled function is pickled with an
identity drawn at random in each process, so a closure over one was compiled anew by every process. And all closures of
one ``def`` share their name, hence their symbols. ``content_of`` says what a closure holds by content,
``named_by_content`` puts it into its name, ``ClosureCache`` keys the cache with it.
"""

from __future__ import annotations

import hashlib
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen, serialize
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher


def keep_copies_private() -> None:
    """From here on each library that numba compiles calls its own copies of what was linked into it, whatever else the
    process holds."""
    library: Any = codegen.CPUCodeLibrary
    if getattr(library, "copies_are_private", False):
        return
    make_ready = library._finalize_final_module

    def _finalize_final_module(self: Any) -> None:
        if self._shared_module is None:  # not one that comes from the cache
            _separate(self)
        make_ready(self)

    library._finalize_final_module = _finalize_final_module
    library.copies_are_private = True


def _separate(library: Any) -> None:
    """Set aside the module for linking into others, with every definition visible; make local in the library's own
    what was linked into it."""
    final = library._final_module
    linked = {
        f.name
        for other in library._linking_libraries
        for f in other._get_module_for_linking().functions
        if not f.is_declaration
    }
    defined = [f for f in final.functions if not f.is_declaration]
    copies = [f for f in defined if f.name in linked]
    if not copies:
        return
    library._shared_module = final.clone()
    for function in defined:
        if function.linkage == llvm.Linkage.external:
            library._shared_module.get_function(
                function.name
            ).linkage = "linkonce_odr"  # as numba does when it is asked for this module
    for function in copies:
        function.linkage = "internal"


def content_of(function: FunctionType, file_key) -> str:
    """Hash of a function's code and of what its closure holds; compiled functions in it by their content, not by their
    identity.

    ``file_key`` gives the hash of a source file and of what it can reach: what a function finds among the globals of
    its module.
    """
    digest = hashlib.sha256(function.__code__.co_code)
    digest.update(repr((function.__qualname__, function.__code__.co_firstlineno)).encode())
    digest.update(file_key(function.__code__.co_filename).encode())
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        held = cell.cell_contents
        digest.update(name.encode())
        if isinstance(held, Dispatcher):
            digest.update(
                content_of(held.py_func, file_key).encode() + repr(sorted(held.targetoptions.items())).encode()
            )
        else:
            digest.update(serialize.dumps(held))
    return digest.hexdigest()


class ClosureCache(FunctionCache):
    """The cache of one closure, found by its content."""

    def __init__(self, function: FunctionType, content: str) -> None:
        super().__init__(function)
        self._content = content

    def _index_key(self, sig, codegen):
        return (sig, codegen.magic_tuple(), self._content)
