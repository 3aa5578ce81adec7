"""Studies, benchmarks and examples read no option that they do not have: a parser's result tells no type checker."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = [
    path
    for folder in ("studies", "benchmarks", "examples")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if "parse_args" in path.read_text()
]


def called(node, name):
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == name


def options(tree):
    """Names of the options that are added, and of those that are read where they were parsed."""
    has, read = set(), set()
    for node in ast.walk(tree):
        if called(node, "add_argument"):
            words = [word.value for word in node.args if isinstance(word, ast.Constant)]
            named = [key.value.value for key in node.keywords if key.arg == "dest"]
            long = [word for word in words if word.startswith("--")] or words
            has |= set(named or [long[0].lstrip("-").replace("-", "_")])
        elif called(node, "set_defaults"):
            has |= {key.arg for key in node.keywords}
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        inside = list(ast.walk(function))
        parsed = {
            target.id
            for node in inside
            if isinstance(node, ast.Assign) and called(node.value, "parse_args")
            for target in node.targets
            if isinstance(target, ast.Name)
        }
        read |= {
            node.attr
            for node in inside
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in parsed
        }
    return has, read


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_option_that_is_read_is_there(path):
    has, read = options(ast.parse(path.read_text()))
    assert not read - has, f"read, but no option: {', '.join(sorted(read - has))}"
    assert has or path.name == "validation_table.py"  # which says what it does, and takes none
