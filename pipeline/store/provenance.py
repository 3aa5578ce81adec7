"""Where a result came from: versions, sources, machine, command; enough to make it again."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import platform
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

HOUSE = Path(__file__).resolve().parents[2]
DISTRIBUTION = "bolide"
LIBRARIES = ("numba", "llvmlite", "numpy", "scipy", "h5py", "trimesh", "pyvista", "vtk", "pydantic", "pint", "tbb")


@functools.cache
def version(distribution: str = DISTRIBUTION) -> str:
    """Version of an installed distribution, ``"unknown"`` when it is not installed; of this project, run from a
    checkout, that of the checkout."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        project = HOUSE / "pyproject.toml"
        return (
            str(tomllib.loads(project.read_text())["project"]["version"])
            if distribution == DISTRIBUTION and project.is_file()
            else "unknown"
        )


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's content."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def source_key(module: str) -> str:
    """Hash of a module's source and of all sources of this project that it reaches (the key of its compiled
    kernels)."""
    from matter.compilation import jit

    spec = importlib.util.find_spec(module)
    return jit.source_key(Path(spec.origin).resolve()) if spec and spec.origin else "unknown"


def commit() -> dict[str, Any]:
    """Git commit of the checkout that this package runs from, and whether it had changes; empty outside a checkout."""
    if not (HOUSE / ".git").exists():
        return {}
    try:
        ask = ["git", "-C", str(HOUSE)]
        head = subprocess.run(
            [*ask, "rev-parse", "HEAD"], capture_output=True, text=True, timeout=10, check=True
        ).stdout.strip()
        changed = subprocess.run(
            [*ask, "status", "--porcelain"], capture_output=True, text=True, timeout=10, check=True
        ).stdout
        return {"commit": head, "uncommitted_changes": bool(changed.strip())}
    except (OSError, subprocess.SubprocessError):
        return {}


def commit_words(told: Mapping[str, Any] | None) -> str:
    """What ``commit`` has told, in words; the version outside a checkout, nothing where nothing was told."""
    if told is None:
        return ""
    changed = " and changes that are not committed" if told.get("uncommitted_changes") else ""
    return f"{told['commit']}{changed}" if told.get("commit") else f"version {version()}"


def machine() -> dict[str, Any]:
    """The machine: system, processor, cores that this process may use, memory."""
    return {
        "platform": platform.platform(),
        "processor": _processor(),
        "cores": cores(),
        "memory_bytes": memory_bytes(),
        "python": sys.version.split()[0],
    }


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def memory_bytes() -> int:
    """Physical memory [bytes]; 0 where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return 0


def libraries() -> dict[str, str]:
    """Versions of the libraries that a result can depend on."""
    return {name: version(name) for name in LIBRARIES}
