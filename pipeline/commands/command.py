"""The frame around every command: whose packages are imported, signals, exit codes, and one line instead of a
traceback.

Exit codes: 0 done; 1 ran, but a check of its own soundness failed; 2 bad input; 75 stopped on request or by a full
disk, resumable.
"""

from __future__ import annotations

import functools
import importlib.util
import inspect
import os
import signal
import sys
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

ROOMS = ("matter", "nbody", "sph", "handoff", "dem", "crater", "pipeline")
HOUSE = Path(__file__).resolve().parents[2]
INTERRUPTED = 75
LONGEST = 4000
"""Characters of a message on standard error."""


def foreign_rooms() -> list[str]:
    """A sentence for every package of this project that Python would import from elsewhere: their names are common
    ones."""
    sentences = []
    for room in ROOMS:
        spec = importlib.util.find_spec(room)
        if spec is None:
            sentences.append(f"package {room!r} of bolide is missing")
        elif spec.origin is None or HOUSE not in Path(spec.origin).resolve().parents:
            where = spec.origin or ", ".join(spec.submodule_search_locations or [])
            sentences.append(f"package {room!r} is imported from {where}, not from bolide in {HOUSE}")
    return sentences


def script(function: Callable[..., Any]) -> Callable[[], NoReturn]:
    """The console script of a command function."""
    return functools.partial(start, function)


def start(function: Callable[..., Any]) -> NoReturn:
    """Run one command function with the process's arguments and end with its exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):  # until a run can save something, to stop is simply to stop
        signal.signal(number, lambda *_: os._exit(INTERRUPTED))
    if wrong := foreign_rooms():
        fail("; ".join(wrong) + ": rename or remove that package, or install bolide in its own virtual environment", 2)
    app = typer.Typer(
        pretty_exceptions_enable=False, rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]}
    )
    app.command()(_with_version(function))
    app(prog_name=function.__name__)
    raise SystemExit(0)


def _with_version(function: Callable[..., Any]) -> Callable[..., Any]:
    """The command with an option ``--version``; of a parameter whose type is a dataclass every field is an option.
    typer reads options from a signature."""
    signature = inspect.signature(function, eval_str=True)
    groups: dict[str, Any] = {
        name: one.annotation for name, one in signature.parameters.items() if is_dataclass(one.annotation)
    }

    @functools.wraps(function)
    def command(*given: Any, version: bool = False, **options: Any) -> Any:
        for name, group in groups.items():
            options[name] = group(**{field.name: options.pop(field.name) for field in fields(group)})
        return function(*given, **options)

    option = Annotated[
        bool, typer.Option("--version", is_eager=True, callback=show_version, help="Print the version and exit.")
    ]
    parameters: list[inspect.Parameter] = []
    for name, one in signature.parameters.items():
        parameters += inspect.signature(groups[name]).parameters.values() if name in groups else [one]
    parameters.append(inspect.Parameter("version", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=option))
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return command


def show_version(wanted: bool) -> None:
    """Print version and commit and end, where that is ``wanted``."""
    if wanted:
        from pipeline.store import provenance

        commit = provenance.commit().get("commit", "")
        print(f"bolide {provenance.version()}" + (f" (commit {commit[:12]})" if commit else ""))
        raise SystemExit(0)


def fail(message: str, code: int) -> NoReturn:
    """End the process with a message on standard error; one that nobody could read is cut."""
    if len(message) > LONGEST:
        message = f"{message[: LONGEST - 200]}\n ... ({len(message)} characters in all)"
    print(message, file=sys.stderr, flush=True)
    raise SystemExit(code)


def guarded(action: Callable[[], int | None]) -> NoReturn:
    """Do what a command does and end with its exit code; what is wrong with its input or its files becomes one
    message."""
    from matter import errors

    try:
        code = action() or 0
        sys.stdout.flush()
    except (errors.InputError, errors.Stopped, errors.Unsound, errors.UnphysicalState) as reason:
        fail(str(reason), reason.exit_code)
    except BrokenPipeError:  # whoever read the output has seen enough of it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(0) from None
    except UnicodeDecodeError as reason:
        fail(f"a file is not the text that it should be: {reason}", errors.InputError.exit_code)
    except OSError as reason:
        from matter.files import archive

        if reason.errno in archive.FULL:
            fail(f"{worded(reason)}: make room, the same command resumes", errors.Stopped.exit_code)
        fail(worded(reason), errors.InputError.exit_code)
    raise SystemExit(code)


def worded(reason: OSError) -> str:
    """What the operating system, or a library that reads files, complains about: one line with the file's name."""
    words = reason.strerror or (str(reason) or type(reason).__name__).splitlines()[0]
    names = " -> ".join(str(name) for name in (reason.filename, reason.filename2) if name)
    return f"{names}: {words}" if names else f"cannot read or write a file: {words}"


def watched(name: str, work: Callable[[], int]) -> int:
    """Run something long with a progress line; SIGINT and SIGTERM let it save first."""
    from matter import progress
    from pipeline.running.journal import signals
    from pipeline.running.screen import screen

    display = screen()
    progress.listen(lambda state: display.moves(name, state))
    try:
        with signals(display):
            return work()
    finally:
        display.close()


def quantity(text: str, unit: str, option: str) -> float:
    """The SI value of an option's text; raises ``InputError``."""
    from matter.case import quantity as quantities
    from matter.errors import InputError

    try:
        return quantities.parse(text, unit)
    except ValueError as reason:
        raise InputError(f"{option}: {reason}") from None


def point(text: str | None, option: str) -> tuple[float, float, float] | None:
    """Three numbers with commas between them; raises ``InputError``."""
    from matter.errors import InputError

    if text is None:
        return None
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{option} {text!r}: three numbers are needed, '0,0,1' for example") from None
    return x, y, z
