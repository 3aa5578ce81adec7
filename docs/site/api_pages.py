"""The page of the Python interface: what ``import bolide`` gives, from its signatures and docstrings."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Any


def page(prose: Callable[[str], str]) -> str:
    """The page: every public name of the package, and what each class holds."""
    import bolide

    parts = [
        "# The `bolide` package",
        "What `import bolide` gives. Examples with `>>>` are run by the tests.",
    ]
    for name in bolide.__all__:
        found = getattr(bolide, name)
        one = found if inspect.isclass(found) or inspect.isroutine(found) else type(found)
        parts += [f"## `bolide.{name}`", *of_one(name, found, prose)]
        if inspect.isclass(found) and not issubclass(found, Exception):
            for key, member in vars(one).items():
                if not key.startswith("_") and inspect.getdoc(member) and not isinstance(member, type):
                    if callable(member) or hasattr(member, "func"):
                        parts += [f"### `{name}.{key}`", *of_one(f"{name}.{key}", member, prose)]
    return "\n\n".join(parts) + "\n"


def of_one(name: str, found: Any, prose: Callable[[str], str]) -> list[str]:
    """Signature and docstring of a name."""
    parts = []
    target = getattr(found, "func", found)
    if inspect.isroutine(target) and not hasattr(found, "func"):
        said = str(inspect.signature(target)).replace("self, ", "").replace("(self)", "()")
        parts.append(f"```python\n{name}{plain(said)}\n```")
    parts.append(with_examples(inspect.getdoc(target) or inspect.getdoc(type(found)) or "", prose))
    return parts


def plain(signature: str) -> str:
    """A signature without the quotes of annotations that are kept as text."""
    return re.sub(r"(?<=[:>] )'([^']*)'", r"\1", signature)


def with_examples(doc: str, prose: Callable[[str], str]) -> str:
    """A docstring as Markdown, its ``>>>`` examples as code."""
    parts = []
    for block in re.split(r"\n\s*\n", doc):
        parts.append(f"```pycon\n{block}\n```" if block.lstrip().startswith(">>>") else prose(block))
    return "\n\n".join(parts)
