"""The named errors of the project; each maps to one exit code of the commands.

========================  ====  =======================================================
error                     exit  meaning
========================  ====  =======================================================
``InputError``            2     what the user gave cannot be used; one clear message
``UnphysicalState``       1     a kernel met a state that no law covers
``Unsound``               1     the run ended, but a check of its own soundness failed
``Stopped``               75    stopped on request or by a full disk; the same command resumes
========================  ====  =======================================================
"""

from __future__ import annotations


class InputError(ValueError):
    """Bad input: the message says what, where, the allowed range and the nearest valid name."""

    exit_code = 2


class Unsound(RuntimeError):
    """The calculation ended, but a limit on its own soundness (ledger, drift, overlap) is broken."""

    exit_code = 1


class UnphysicalState(RuntimeError):
    """A particle reached a state that no law covers; the message holds particle, position, time and values."""

    exit_code = 1


class Stopped(RuntimeError):
    """Stopped on request after saving a checkpoint, or by a full disk; the same command resumes."""

    exit_code = 75
