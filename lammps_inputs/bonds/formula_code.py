"""Differentiate a formula with SymPy, and write the results as plain Python arithmetic."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.bonds.formula_text import FUNCTIONS, STRAIN, read_formula
from chaincor.lammps_inputs.bonds.functions import exp_less_one, exponential
from chaincor.lammps_inputs.errors import PotentialError

if TYPE_CHECKING:
    import sympy

# Largest total number of operations in energy, force and stiffness. A formula that fills a page has
# some hundreds.
_MOST_OPERATIONS = 3000
# Number of terms in the series about the natural length, after the first term.
SERIES_TERMS = 22


class FormulaParameters(NamedTuple):
    """Parameters of a formula's kernel."""

    #: Parameters of the formula, sorted by name; one zero if there are none.
    given: tuple[float, ...]
    rest: float  #: Strain of the natural length, in the formula's definition of strain.
    near: float  #: Largest strain for which the series is used.
    #: Coefficients of force/strain, beginning with the constant: -k, -k g_1, ...
    series: tuple[float, ...]


@dataclass(frozen=True)
class FormulaCode:
    """Energy, force and stiffness of a formula, for any values of its parameters."""

    #: U, -U' and U'' as Python text in ``s`` and ``p[0]``, ``p[1]`` ...
    energy: str
    force: str  #: Force -U' as Python text.
    curvature: str  #: Stiffness U'' as Python text.
    #: Expressions that must not vanish: arguments of log, and bases of powers, unless the exponent
    #: is a positive whole number.
    guards: tuple[str, ...]

    def function(self, text: str, values: tuple[float, ...], digits: Any = None) -> Callable:
        """
        Return one of the texts as a function of the strain, in the formula's definition of strain.

        `values` are the values of the parameters, sorted by name. `digits` is an mpmath context,
        for more digits than those of doubles.
        """
        known = {name: getattr(digits or np, name) for name in FUNCTIONS}
        known["p"] = values if digits is None else tuple(map(digits.mpf, values))
        return eval(f"lambda s: {text}", {"__builtins__": {}} | known)

    @cached_property
    def kernels(self) -> tuple[Callable, Callable]:
        """Force and U'' for compiled loops."""
        ones, orders = [1.0] * (SERIES_TERMS + 1), range(1, SERIES_TERMS + 2)
        force = _kernel_of("formula", self.force, "x*", ones)
        return force, _kernel_of("curvature", self.curvature, "", [-float(k) for k in orders])


def _kernel_of(name: str, formula: str, power: str, factors: list[float]) -> Callable:
    """
    Return a function of the strain: a series at small strains, otherwise the formula.

    At small strains the formula would lose digits by cancellation. Series and formula are always
    evaluated, and one of them is multiplied by zero. Without a branch, loops can be vectorised, and
    the same code works for arrays.
    """
    digest = hashlib.sha256(formula.encode()).hexdigest()[:16]
    terms = [
        f"{factor!r}*c[{k}]" if factor != 1.0 else f"c[{k}]" for k, factor in enumerate(factors)
    ]
    horner = terms[-1]
    for term in reversed(terms[:-1]):
        horner = f"{term} + x*({horner})"
    text = (
        "def enclose(exp, expm1):\n"
        "  def kernel(strain, parameters):\n"
        "    p, c, near = parameters.given, parameters.series, parameters.near\n"
        "    x = minimum(maximum(strain, -near), near)\n"
        "    is_near = 1.0*(abs(strain) < near)\n"
        "    s = parameters.rest + strain\n"
        f"    return is_near*({power}({horner})) + (1.0 - is_near)*({formula})\n"
        "  return kernel\n"
    )
    known = {each: getattr(np, each) for each in (*FUNCTIONS, "minimum", "maximum", "abs")}
    scope: dict[str, Any] = {"__builtins__": {}, "__name__": __name__} | known
    exec(compile(text, f"<{name} {digest}>", "exec"), scope)
    kernel: Callable = scope["enclose"](exponential, exp_less_one)
    # The qualified name distinguishes compiled loops. It depends only on the code, and compiled
    # loops are therefore found again on disk.
    kernel.__qualname__ = f"{name}_{digest}"
    return kernel


@lru_cache(maxsize=64)
def formula_code(text: str, names: tuple[str, ...]) -> FormulaCode:
    """
    Differentiate an energy with the named parameters, and write the results as Python.

    Raises PotentialError if the text is not a formula, or is too long to differentiate twice.
    """
    import sympy

    energy = read_formula(text, names)
    strain = sympy.Symbol(STRAIN, real=True)
    symbols = {strain: "s"} | {
        sympy.Symbol(name, real=True): f"p[{k}]" for k, name in enumerate(sorted(names))
    }
    _refuse_kinks(energy, text)
    force = -sympy.diff(energy, strain)
    _refuse_long(force, text)
    curvature = -sympy.diff(force, strain)
    _refuse_long(curvature, text)
    _refuse_kinks(curvature, text)
    try:
        return FormulaCode(
            energy=_written(energy, symbols),
            force=_written(force, symbols),
            curvature=_written(curvature, symbols),
            guards=tuple(dict.fromkeys(_written(g, symbols) for g in _guards(energy, strain))),
        )
    except (OverflowError, TypeError, ValueError):
        raise PotentialError(
            f"energy {text!a} has no finite value. Give a formula that is finite at every "
            "length near 1"
        ) from None


def _refuse_kinks(expression: "sympy.Expr", text: str) -> None:
    import sympy

    if expression.has(sympy.Abs, sympy.sign, sympy.Heaviside, sympy.DiracDelta):
        raise PotentialError(
            f"energy {text!a} has a kink, as sqrt(s^2) = |s| has. Give a smooth formula. "
            "For a bond with a kink, use UserBond in Python or a bond table"
        )
    if expression.has(sympy.zoo, sympy.oo, -sympy.oo, sympy.nan, sympy.I):
        raise PotentialError(
            f"energy {text!a} has no finite value. Give a formula that is finite at every "
            "length near 1"
        )


def _refuse_long(expression: "sympy.Expr", text: str) -> None:
    import sympy

    operations = enumerate(sympy.preorder_traversal(expression))
    if any(count > _MOST_OPERATIONS for count, _ in operations):
        raise PotentialError(
            f"energy {text!a} has derivatives of more than {_MOST_OPERATIONS} operations. "
            "Shorten the formula: use fewer factors and fewer nested functions"
        )


def _guards(expression: "sympy.Expr", strain: "sympy.Symbol") -> Sequence["sympy.Expr"]:
    """Return expressions whose signs are constant in any range in which the formula is smooth."""
    import sympy
    from sympy.codegen.cfunctions import log1p

    found = []
    for part in sympy.preorder_traversal(expression):
        if isinstance(part, sympy.Pow) and part.base.has(strain):
            whole = part.exp.is_Integer and part.exp >= 0
            found += [] if whole else [part.base]
        elif isinstance(part, sympy.log) and part.args[0].has(strain):
            found.append(part.args[0])
        elif isinstance(part, log1p) and part.args[0].has(strain):
            found.append(1 + part.args[0])
    return found


def _written(expression: "sympy.Expr", symbols: dict["sympy.Symbol", str]) -> str:
    """Write an expression as Python text, with floats, whole powers and plain function names."""
    import sympy

    def text(part: "sympy.Expr") -> str:
        if part in symbols:
            return symbols[part]
        if part.is_Number or part.is_NumberSymbol:
            return f"({_finite(float(part))!r})"
        if isinstance(part, sympy.Add):
            return f"({' + '.join(map(text, part.args))})"
        if isinstance(part, sympy.Mul):
            return f"({'*'.join(map(text, part.args))})"
        if isinstance(part, sympy.Pow):
            return power(*part.args)
        name = type(part).__name__
        if name not in FUNCTIONS or len(part.args) != 1:
            raise TypeError(name)
        return f"{name}({text(part.args[0])})"

    def power(base: "sympy.Expr", exponent: "sympy.Expr") -> str:
        written = text(base)
        if exponent.is_Integer:
            whole = int(exponent)
            # Keep powers with whole exponents, because compilers replace them by multiplications.
            raised = f"{written}**{abs(whole)}" if abs(whole) != 1 else written
            return f"({raised})" if whole > 0 else f"(1.0/{raised})"
        if exponent.is_Rational and exponent.q == 2 and abs(exponent.p) == 1:
            return f"sqrt({written})" if exponent.p > 0 else f"(1.0/sqrt({written}))"
        return f"({written}**{text(exponent)})"

    return text(expression)


def _finite(number: float) -> float:
    if not abs(number) < 1e300:
        raise OverflowError
    return number
