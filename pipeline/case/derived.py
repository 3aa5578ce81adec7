"""``[sweep.derive]``: keys of a case that follow from what a sweep draws, by arithmetic with units.

    "sph.materials.basalt.drucker_prager.friction_angle" = "friction_angle"
    "sph.materials.basalt.p_alpha.alpha0" = "'3500 kg/m^3' / bulk_density"
    "dem.contact.shell.friction" = "0.8 * tan(friction_angle)"

A name alone hands its value on as it was drawn, a text or true and false too. Otherwise an expression has numbers,
names of drawn quantities, quantities in quotes, ``+ - * / **``, brackets and the ``FUNCTIONS``; nothing else is
evaluated. Units are carried along: metres cannot be added to seconds, and the logarithm of a density is refused.
"""

from __future__ import annotations

import ast
import functools
import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from matter.case import quantity
from pipeline.case.stages import nearest

Number = bool | int | float | str

FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sqrt": math.sqrt, "exp": math.exp, "log": math.log, "sin": math.sin, "cos": math.cos, "tan": math.tan,
    "atan": math.atan,
}  # fmt: skip
"""Of a number, or of an angle; ``sqrt`` of any quantity; ``atan`` is an angle."""


def _power(base: Any, exponent: Any) -> Any:
    """Of floating-point numbers: a whole number to a power of a power would be worked out to its last digit."""
    result = (float(base) if isinstance(base, int) else base) ** exponent
    if isinstance(getattr(result, "magnitude", result), complex):
        raise ValueError("it is a root of a negative number")
    return result


_OPERATIONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: _power,
}  # fmt: skip
_SUMS = (ast.Add, ast.Sub)
_SIGNS: dict[type, Callable[[Any], Any]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_LONGEST = 200
_ALLOWED = f"+ - * / **, numbers, drawn quantities, 'quantities in quotes' and {', '.join(FUNCTIONS)}"


@functools.lru_cache(maxsize=1024)
def _tree(text: str) -> ast.expr:
    """The parsed expression. Raises ``ValueError``."""
    if len(text) > _LONGEST:
        raise ValueError(f"an expression has at most {_LONGEST} characters, not {len(text)}")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ValueError(f"cannot read {text!r} as an expression: it may hold {_ALLOWED}") from None


def names_in(text: str) -> set[str]:
    """The drawn quantities that an expression names; empty where it cannot be read."""
    try:
        tree = _tree(text)
    except ValueError:
        return set()
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in called}


def faults(text: str, drawn: Iterable[str]) -> list[str]:
    """What is wrong with an expression of the ``drawn`` names, a sentence each."""
    try:
        return list(dict.fromkeys(_faults(_tree(text), list(drawn))))
    except ValueError as reason:
        return [str(reason)]


def _faults(node: ast.expr, drawn: list[str]) -> Iterator[str]:
    match node:
        case ast.Constant(value=bool(truth)):
            yield f"{truth} is not a number"
        case ast.Constant(value=str(text)):
            try:
                quantity.measured(text)
            except ValueError as reason:
                yield str(reason)
        case ast.Constant(value=int() | float()):
            pass
        case ast.Name(id=name):
            if name not in drawn:
                known = f" (drawn: {', '.join(drawn)})" if drawn else " (nothing is drawn)"
                yield f"no quantity {name!r} is drawn{nearest(name, drawn) or known}"
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
            yield from _faults(left, drawn)
            yield from _faults(right, drawn)
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _SIGNS:
            yield from _faults(operand, drawn)
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]):
            if name not in FUNCTIONS:
                near = nearest(name, list(FUNCTIONS)) or f" (there are {', '.join(FUNCTIONS)})"
                yield f"there is no function {name!r}{near}"
            yield from _faults(argument, drawn)
        case _:
            yield f"{ast.unparse(node)!r} is no part of an expression: it may hold {_ALLOWED}"


def value(text: str, drawn: Mapping[str, Number]) -> Number:
    """What an expression without ``faults`` comes to: a number, or a text with a unit (``drawn``: likewise, by name).

    Raises ``ValueError`` where units do not fit, or it has no finite value.
    """
    import pint

    tree = _tree(text)
    if isinstance(tree, ast.Name):
        return drawn[tree.id]
    try:
        return _written(_evaluated(tree, drawn))
    except OverflowError:
        raise ValueError(f"{text!r} has no value: it is not a finite number") from None
    except (ArithmeticError, pint.errors.PintError, ValueError) as reason:
        raise ValueError(f"{text!r} has no value: {reason}") from None


def _evaluated(node: ast.expr, drawn: Mapping[str, Number]) -> Any:
    match node:
        case ast.Constant(value=str(text)):
            return quantity.measured(text)
        case ast.Constant(value=number):
            return number
        case ast.Name(id=name):
            given = drawn[name]
            if isinstance(given, bool):
                raise ValueError(f"{name} is true or false, and can only be handed on as it is")
            return quantity.measured(given) if isinstance(given, str) else given
        case ast.BinOp(left=left, op=op, right=right):
            one, other = _evaluated(left, drawn), _evaluated(right, drawn)
            # the unit library takes a number for radians
            if isinstance(op, _SUMS) and _is_number(one) != _is_number(other):
                raise ValueError(f"{ast.unparse(node)!r} adds a number to a quantity with a unit")
            return _OPERATIONS[type(op)](one, other)
        case ast.UnaryOp(op=op, operand=operand):
            return _SIGNS[type(op)](_evaluated(operand, drawn))
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            return _applied(name, _evaluated(argument, drawn))
    raise AssertionError(ast.dump(node))  # ``faults`` comes before


def _is_number(item: Any) -> bool:
    """Whether it has neither a dimension nor an angle's unit."""
    return isinstance(item, int | float) or bool(item.to_base_units().unitless)


def _applied(name: str, argument: Any) -> Any:
    """A function of a number or a quantity."""
    plain = isinstance(argument, int | float)
    if name == "sqrt" and not plain:
        return _power(argument, 0.5)
    if not plain:
        base = argument.to_base_units()
        if not base.dimensionless:
            raise ValueError(f"{name} is of a number or an angle, not of a quantity in {argument.units:~C}")
        argument = base.magnitude
    result = FUNCTIONS[name](argument)
    return result * quantity.measured("1 rad") if name == "atan" else result


def _written(result: Any) -> int | float | str:
    """A number or a quantity as a case holds it; one without a dimension becomes a number, unless it is an angle."""
    unit = ""
    if not isinstance(result, int | float):
        base = result.to_base_units()
        if base.unitless:
            result = base.magnitude
        else:
            result, unit = float(result.magnitude), f"{result.units:~C}".replace("**", "^")
    if not math.isfinite(result):
        raise ValueError("it is not a finite number")
    return f"{result!r} {unit}" if unit else result
