"""Pages as a browser sees them, for tests."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL without a graphics card."""


def dom(file: Path, folder: Path, *options: str) -> str:
    """The page in ``file`` after its scripts, as text; its profile lies in ``folder``. Skips where no Chromium is."""
    program = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chromium-browser")
    if program is None:
        pytest.skip("no Chromium on this machine")
    quiet = [
        "--headless",
        "--no-sandbox",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
    ]
    place = [f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=3000", "--dump-dom"]
    return subprocess.run(
        [program, *quiet, *options, *place, f"file://{file}"], capture_output=True, text=True, timeout=120
    ).stdout
