"""Check the text of a bond energy by a grammar, and read it as a SymPy expression."""

import ast
import keyword
import math
import operator
import re
import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from chaincor.lammps_inputs.errors import PotentialError

if TYPE_CHECKING:
    import sympy

# These functions are analytic if they are finite. A force made of them has no kinks.
FUNCTIONS = (
    "exp", "expm1", "log", "log1p", "sqrt", "sin", "cos", "sinh", "cosh", "tanh"
)  # fmt: skip
STRAIN, LENGTH = "s", "r"
_EXPECTED = (
    "Use only numbers, s (the strain), r (the length 1 + s), pi, parameters, + - * / ^ and "
    f"{', '.join(FUNCTIONS)}"
)
_RESERVED = (STRAIN, LENGTH, "pi", *FUNCTIONS)

# Limits that no formula written by hand reaches. Longer formulas would take minutes to
# differentiate or to compile.
_LONGEST_TEXT, _MOST_NODES, _DEEPEST, _MOST_PARAMETERS = 400, 160, 24, 20
_LARGEST, _SMALLEST, _HIGHEST_POWER = 1e100, 1e-100, 99
_OPERATIONS: dict[type[ast.operator], Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_OTHER_CHARACTER = re.compile(r"[^A-Za-z0-9_.+\-*/^(), ]")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")


def check_parameters(given: Any) -> dict[str, float]:
    """
    Return the parameters of a formula, sorted by name.

    Raises ValueError with one line that names the parameter.
    """
    if not isinstance(given, Mapping):
        raise ValueError("Give names and numbers, such as { D = 0.0139, a = 6.0 }")
    if len(given) > _MOST_PARAMETERS:
        raise ValueError(f"there are {len(given)} of them. Give at most {_MOST_PARAMETERS}")
    return {name: _checked(name, given[name]) for name in sorted(given, key=str)}


def _checked(name: Any, value: Any) -> float:
    shown = repr(name)[:60]
    if not isinstance(name, str) or not _NAME.fullmatch(name) or keyword.iskeyword(name):
        raise ValueError(
            f"{shown} cannot be the name of a parameter. Give a name that starts with a "
            "letter, has at most 32 letters, digits and underscores, and is no word of "
            "Python"
        )
    if name in _RESERVED:
        raise ValueError(
            f"{shown} means something else in a formula. Give the parameter another name"
        )
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{name} is {repr(value)[:60]}. Give a number")
    if not (value == 0 or _SMALLEST <= abs(value) <= _LARGEST):
        raise ValueError(
            f"{name} is {repr(value)[:60]}. Give a finite number with a size from "
            f"{_SMALLEST:g} to {_LARGEST:g}"
        )
    return float(value)


def canonical_text(text: str) -> str:
    """Return a canonical text, independent of blanks, brackets and the notation of powers."""
    return ast.unparse(_parsed(text))


def read_formula(text: str, names: Iterable[str]) -> "sympy.Expr":
    """
    Read a formula of ``s``, the strain, or ``r``, the length, that uses all parameters.

    Returns an expression of real symbols with these names, in which r = 1 + s. Raises
    PotentialError with the mistake in the text and the allowed forms.
    """
    import sympy

    tree = _parsed(text)
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    unused = sorted(set(names) - used)
    if unused:
        raise _refused(
            text, f"does not use the parameter '{unused[0]}'", "Remove the parameter, or use it"
        )
    if not used & {STRAIN, LENGTH}:
        raise _refused(
            text,
            "does not depend on the strain",
            "Write the energy as a function of s, or of r = 1 + s",
        )
    symbols: dict[str, Any] = {name: sympy.Symbol(name, real=True) for name in (STRAIN, *names)}
    symbols |= {LENGTH: 1 + symbols[STRAIN], "pi": math.pi}
    return _value(text, tree, symbols)


def number_in(text: str) -> float:
    """Return the value of a formula without variables; raise PotentialError if it has none."""
    return float(_value(text, _parsed(text), {"pi": math.pi}))


def _value(text: str, tree: ast.Expression, symbols: Mapping[str, Any]) -> Any:
    try:
        return _Reader(text, symbols).read(tree.body)
    except (OverflowError, ZeroDivisionError, RecursionError, TypeError, ValueError):
        raise _refused(text, "has no finite value", _EXPECTED) from None


def _parsed(text: str) -> ast.Expression:
    if len(text) > _LONGEST_TEXT:
        raise _refused(text, f"has {len(text)} characters", f"Use at most {_LONGEST_TEXT}")
    other = _OTHER_CHARACTER.search(text)
    if other is not None:
        raise _refused(text, f"has the character {other[0]!a}", _EXPECTED)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text.strip().replace("^", "**"), mode="eval")
    except (SyntaxError, RecursionError, MemoryError, ValueError):
        raise _refused(text, "cannot be read", _EXPECTED) from None
    if sum(isinstance(node, ast.expr) for node in ast.walk(tree)) > _MOST_NODES:
        raise _refused(
            text, "is too long", f"Use at most {_MOST_NODES} numbers, names and operations"
        )
    if _depth(tree) > _DEEPEST:
        raise _refused(text, "is nested too deeply", f"Use at most {_DEEPEST} levels")
    return tree


def _depth(tree: ast.AST) -> int:
    depth, level = 0, [tree]
    while level:
        depth += 1
        level = [c for node in level for c in ast.iter_child_nodes(node) if isinstance(c, ast.expr)]
    return depth


def _refused(text: str, problem: str, remedy: str) -> PotentialError:
    shown = ascii(text) if len(text) <= 80 else ascii(text[:77]) + "..."
    return PotentialError(f"energy {shown} {problem}. {remedy}")


def _is_symbolic(term: Any) -> bool:
    return not isinstance(term, int | float)


def _double(number: float) -> "sympy.Float":
    import sympy

    return sympy.Float(float(number))


class _Reader:
    """Converter of allowed syntax nodes into numbers and SymPy expressions."""

    def __init__(self, text: str, symbols: Mapping[str, Any]) -> None:
        self._text, self._symbols = text, symbols

    def read(self, node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return self._number(value)
            case ast.Name(id=name) if name in self._symbols:
                return self._symbols[name]
            case ast.Name(id=name):
                hint = "a function" if name in FUNCTIONS else "an unknown parameter"
                raise self._refuse(f"uses '{name[:40]}', {hint}", _EXPECTED)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -self.read(operand)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.read(operand)
            case ast.BinOp(left=left, op=op, right=right):
                return self._operation(self.read(left), op, self.read(right))
            case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if (
                name in FUNCTIONS and not isinstance(argument, ast.Starred)
            ):
                return self._call(name, self.read(argument))
            case ast.Call(func=ast.Name(id=name)):
                if name in FUNCTIONS:
                    raise self._refuse(
                        f"calls {name} with other arguments than one number",
                        f"Write {name}(x) with one argument",
                    )
                raise self._refuse(f"calls '{name[:40]}'", f"Use one of {', '.join(FUNCTIONS)}")
        raise self._refuse(f"contains {type(node).__name__}", _EXPECTED)

    def _operation(self, left: Any, op: ast.operator, right: Any) -> Any:
        numbers = not _is_symbolic(left) and not _is_symbolic(right)
        if not numbers and not isinstance(op, ast.Pow):
            # Numbers become doubles, because SymPy's integers may have millions of digits.
            left, right = (x if _is_symbolic(x) else _double(x) for x in (left, right))
        if isinstance(op, ast.Div) and not numbers and right == 0:
            raise ZeroDivisionError
        if isinstance(op, ast.Pow):
            found = self._power(left, right)
        elif type(op) in _OPERATIONS:
            found = _OPERATIONS[type(op)](left, right)
        else:
            raise self._refuse(f"has the operator {type(op).__name__}", _EXPECTED)
        return self._number(found) if numbers else found

    def _power(self, base: Any, exponent: Any) -> Any:
        if isinstance(base, int | float):
            if isinstance(exponent, int | float):
                return float(base) ** float(exponent)
            if base <= 0:
                raise self._refuse(f"has a power of {base:g}", "Use powers of positive numbers")
        if isinstance(exponent, float) and exponent.is_integer():
            exponent = int(exponent)
        if isinstance(exponent, int | float) and abs(exponent) > _HIGHEST_POWER:
            raise self._refuse(
                f"has the power {exponent:g}",
                f"Use powers from -{_HIGHEST_POWER} to {_HIGHEST_POWER}",
            )
        return (base if _is_symbolic(base) else _double(base)) ** exponent

    def _call(self, name: str, argument: Any) -> Any:
        if not _is_symbolic(argument):
            return self._number(getattr(math, name)(argument))
        import sympy
        from sympy.codegen import cfunctions

        function: Callable = getattr(cfunctions if name in ("expm1", "log1p") else sympy, name)
        return function(argument)

    def _number(self, value: Any) -> int | float:
        if isinstance(value, complex) or not (value == 0 or _SMALLEST <= abs(value) <= _LARGEST):
            raise self._refuse(
                f"contains the number {value:.6g}"
                if isinstance(value, float)
                else "contains a number out of range",
                f"Use numbers with sizes from {_SMALLEST:g} to {_LARGEST:g}",
            )
        # Whole numbers that are not exact in double precision become doubles.
        return value if isinstance(value, int) and abs(value) < 2**53 else float(value)

    def _refuse(self, problem: str, remedy: str) -> PotentialError:
        return _refused(self._text, problem, remedy)
