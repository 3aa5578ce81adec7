"""The one policy for compiled code: decorators, threads, and a cache that cannot serve stale physics.

numba's own cache looks only at the file of the compiled function: after an edit of a law in *another* file it silently
returns the old law (numba issue 9483). Here the cache folder of a function is keyed by a hash over every source file
of this project that its module can reach by imports, and by the numba version, so an edited law is always recompiled
and an untouched room never is. A kernel runs the same machine code whether this process compiled it or loaded it
(``matter.compilation.kernel_cache``).

Decorators
----------
``law``     a pure scalar law, no arrays, no allocation; ``law_function.py_func`` is the plain Python function, so that
            the same source compiles for CPU loops and for CUDA device functions.
``kernel``  a loop over particles on one thread.
``parallel_kernel``  the same with ``prange`` on threads.
``inner_kernel``  a loop that other kernels call and Python does not.

``fastmath`` belongs in pair loops only: it assumes that no NaN exists, so checks for NaN live in kernels without it.
"""

from __future__ import annotations

import ctypes
import errno
import functools
import glob
import hashlib
import os
import re
import stat
import sys
import tempfile
import time
from pathlib import Path

_BEGAN = time.time()
ROOMS = ("matter", "nbody", "sph", "handoff", "dem", "crater", "pipeline")
HOUSE = Path(__file__).resolve().parents[2]


def _preload_tbb() -> None:
    """Make the TBB of the virtual environment visible to numba: pip puts it where the loader does not look."""
    for path in sorted(glob.glob(os.path.join(sys.prefix, "lib", "libtbb.so.*"))):
        try:
            ctypes.CDLL(path, mode=ctypes.RTLD_GLOBAL)
            return
        except OSError:
            continue


_preload_tbb()

import llvmlite.binding  # noqa: E402
import numba  # noqa: E402  (TBB has to be loaded first)

from matter.compilation import kernel_cache, law_dispatcher  # noqa: E402  (and numba after it)

kernel_cache.keep_copies_private()
law_dispatcher.leave_out_wrappers_of_loop_bodies()

# TBB balances uneven loops (chunks are stolen), the others split statically: measured 1.97 against 1.07 threads on an
# uneven loop
numba.config.THREADING_LAYER_PRIORITY = ["tbb", "omp", "workqueue"]

# One vector of a loop at a time. LLVM would take four side by side wherever it believes to have the registers; in the
# pairs of the shock stage (some 20 sums, 40 constants) a third of what it then does is to move them to the stack and
# back: 24.5 -> 19.5 ns a neighbour visit with vectors of 256 bits. Gravity and grains do not notice.
llvmlite.binding.set_option("bolide", "--force-vector-interleave=1")


# read as text: to parse 230 sources takes over a second of every command
_IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^(\n#]+)|import[ \t]+([^\n#]+))", re.MULTILINE
)


@functools.cache
def _local_imports(path: Path) -> tuple[Path, ...]:
    """The project's own source files that ``path`` imports, directly."""
    files: set[Path] = set()
    names: set[str] = set()
    for module, taken, modules in _IMPORT.findall(path.read_text()):
        listed = re.sub(r"#[^\n]*", "", taken.strip("()") or modules).split(",")
        words = [name.split()[0] for name in listed if name.strip()]
        names.update([module, *(f"{module}.{word}" for word in words)] if module else words)
    for name in names:
        parts = name.split(".")
        if parts[0] not in ROOMS:
            continue
        base = HOUSE.joinpath(*parts)
        for candidate in (base.with_suffix(".py"), base / "__init__.py"):
            if candidate.is_file():
                files.add(candidate)
    return tuple(sorted(files))


@functools.cache
def reached_sources(path: Path) -> tuple[Path, ...]:
    """A source file and every project file that it reaches by imports, sorted."""
    reached, waiting = {path}, [path]
    while waiting:
        for other in _local_imports(waiting.pop()):
            if other not in reached:
                reached.add(other)
                waiting.append(other)
    return tuple(sorted(reached))


@functools.cache
def source_key(path: Path) -> str:
    """Hash of a source file, of every project file that it reaches by imports, and of the numba version."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in reached_sources(path):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:20]


@functools.cache
def _edited_meanwhile(path: Path) -> bool:
    """Whether a source that a file reaches was written since this process began: what was imported may be its former
    text, whose machine code must not be kept under the hash of the present one."""
    now = time.time()
    return any(_BEGAN < source.stat().st_mtime <= now for source in reached_sources(path))


@functools.lru_cache(maxsize=1)
def cache_root() -> Path:
    """Folder of compiled kernels: ``$BOLIDE_CACHE``, else the user's cache folder, else a temporary one.

    What lies in it is executed: it is made for its owner alone. Raises ``PermissionError`` where it belongs to
    somebody else or others may write to it.
    """
    caches = os.environ.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(caches):  # empty or relative: as if not set (XDG Base Directory Specification)
        caches = os.path.join(os.path.expanduser("~"), ".cache")
    base = os.environ.get("BOLIDE_CACHE") or os.path.join(caches, "bolide", "kernels")
    for root in (Path(base), Path(tempfile.gettempdir()) / f"bolide-kernels-{os.getuid()}"):
        try:
            root.parent.mkdir(parents=True, exist_ok=True)
            root.mkdir(mode=0o700, exist_ok=True)
        except OSError:
            continue
        if os.access(root, os.W_OK):
            return _own(root)
    raise OSError(f"no writable folder for compiled kernels: tried {base} and the temporary folder")


def _own(root: Path) -> Path:
    state = root.stat()
    fault = "belongs to another user" if state.st_uid != os.getuid() else ""
    if state.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        fault = "may be written to by other users"
    if fault:
        why = (
            f"the folder of compiled kernels {fault}, and what lies in it is executed: chmod go-w it where it is yours"
        )
        raise PermissionError(errno.EACCES, f"{why}, or name another in BOLIDE_CACHE", str(root))
    return root


def _compile(function, compiler=numba.njit, **options):
    if numba.config.DISABLE_JIT:
        return function
    source = Path(function.__code__.co_filename).resolve()
    if HOUSE not in source.parents or source.relative_to(HOUSE).parts[0] not in ROOMS:
        return numba.njit(function, error_model="numpy", **options)  # tests and user scripts: compiled, never cached
    numba.config.CACHE_DIR = str(cache_root() / source_key(source))
    content = "" if function.__closure__ is None else kernel_cache.content_of(function, _file_key)
    if content:
        function.__qualname__ += f"_{content[:12]}"
    compiled = compiler(function, error_model="numpy", **options)
    if _edited_meanwhile(source):
        return compiled
    compiled.enable_caching()
    if content:
        compiled._cache = kernel_cache.ClosureCache(function, content)
    return compiled


def _law(function, *, error_model, **options):
    return law_dispatcher.law(function, functools.partial(_compile, **options), error_model=error_model, **options)


def _file_key(name: str) -> str:
    """``source_key`` of a file of the project; of any other, the hash of that file alone."""
    path = Path(name).resolve()
    return source_key(path) if HOUSE in path.parents else hashlib.sha256(path.read_bytes()).hexdigest()


def _decorator(**fixed):
    def decorate(function=None, **options):
        if function is None:
            return functools.partial(decorate, **options)
        return _compile(function, **fixed, **options)

    return decorate


law = _decorator(compiler=_law)
inner_kernel = law
kernel = _decorator(nogil=True, no_cfunc_wrapper=True)
parallel_kernel = _decorator(nogil=True, parallel=True, no_cfunc_wrapper=True)
prange = numba.prange


def one_blas_thread():
    """Hold numpy's and scipy's BLAS to one thread from here on, or, used as a context, while it lasts.

    OpenBLAS threads go on spinning after every call and take the cores from our own loops: a step of the shock stage
    took 16.9 ms beside them, 8.9 ms without (16,000 particles, two cores).
    """
    from threadpoolctl import threadpool_limits

    return threadpool_limits(limits=1, user_api="blas")


def set_threads(count: int | None) -> int:
    """Use ``count`` threads (None: all that numba found), BLAS none but ours, and return the number in use."""
    one_blas_thread()
    available = numba.config.NUMBA_NUM_THREADS
    use = available if count is None else max(1, min(int(count), available))
    numba.set_num_threads(use)
    return use


def _number_pair_intrinsic(name: str):
    """llvm.minnum / llvm.maxnum: a float min or max written as `if` or `min()` stops the vectorisation of a whole pair
    loop (1.8x)."""
    from llvmlite import ir
    from numba.core import types
    from numba.extending import intrinsic

    @intrinsic
    def pair(typingctx, a, b):
        def codegen(context, builder, signature, args):
            double = ir.DoubleType()
            function = builder.module.declare_intrinsic(name, [double], ir.FunctionType(double, [double, double]))
            return builder.call(function, args, fastmath=("nnan", "nsz"))

        return types.float64(types.float64, types.float64), codegen

    return pair


fast_min = _number_pair_intrinsic("llvm.minnum")
fast_max = _number_pair_intrinsic("llvm.maxnum")
