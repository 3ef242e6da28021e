"""
Translate the named bonds from the Python of ``lammps_inputs.bonds.potentials`` to JavaScript.

The translation covers those parts of Python that formulas use: arithmetic, calls, names that are
assigned once, and return statements, which may be in an if statement.
"""

import ast
import inspect
import json
import textwrap
from collections.abc import Callable
from typing import Any

from chaincor.lammps_inputs.bonds.named_bond import NamedBond
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import CHAIN_POTENTIALS, BondKeys

# This table translates names of functions from Python to JavaScript. Functions that `bonds.js`
# defines keep their names.
_CALLS = {
    "minimum": "Math.min",
    "maximum": "Math.max",
    **{
        name: f"Math.{name}"
        for name in ("exp", "expm1", "log", "log1p", "sqrt", "sinh", "cosh", "tanh")
    },
    "exponential": "Math.exp",
    "exp_less_one": "Math.expm1",
    "expm1_minus_x": "expm1MinusX",
    "x_minus_log1p": "xMinusLog1p",
    "square": "square",
}
_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%"}
_COMPARISONS = {ast.Eq: "===", ast.Lt: "<", ast.Gt: ">", ast.LtE: "<=", ast.GtE: ">="}
# This table gives the page's name for each limit of a bond.
_LIMITS = {
    "strain_min": "floor",
    "dissociation": "depth",
    "convex_strain": "convex",
    "barrier_strain": "barrier",
}


def bonds_script() -> str:
    """Return JavaScript that defines ``BONDS``, the functions of each bond, and ``BOND_FORM``."""
    bonds = "\n".join(f"  {name}: {_bond(cls)}," for name, cls in CHAIN_POTENTIALS.items())
    return f"const BONDS = {{\n{bonds}\n}};\nconst BOND_FORM = {{\n{_forms()}\n}};"


def bonds_form() -> list[tuple[str, str, float]]:
    """Return the key, the label and the default value for each parameter in the form."""
    return [(key, *_form(key)[:2]) for cls in CHAIN_POTENTIALS.values() for key in cls.keys]


def _forms() -> str:
    lines = []
    for name, cls in CHAIN_POTENTIALS.items():
        limits = (f"{key}: (scene) => {_form(key)[2]}" for key in cls.keys)
        whole = [key for key, field in cls.keys.items() if cls.__annotations__[field] is int]
        linear = json.dumps(cls.is_harmonic)
        lines.append(
            f"  {name}: {{ linear: {linear}, whole: {json.dumps(whole)}, "
            f"limits: {{ {', '.join(limits)} }} }},"
        )
    return "\n".join(lines)


def _form(key: str) -> tuple[str, float, str]:
    extra: Any = BondKeys.model_fields[key].json_schema_extra
    label, usual, limits = extra["form"]
    return label, usual, limits


def _bond(cls: type[NamedBond]) -> str:
    one = cls(**cls.example)
    given = ", ".join(
        f"{key}: {name} = {json.dumps(getattr(one, name))}" for key, name in cls.keys.items()
    )
    constants = [f"const {name} = {text};" for name, text in cls.constants.items()]
    limits = [f"const {name} = {_value(cls, name)};" for name in _LIMITS if _differs(cls, name)]
    kernel = one.force_kernel
    assert kernel is not None
    assert one.curvature_kernel is not None
    held = [f"{script}: {name}" for name, script in _LIMITS.items() if _differs(cls, name)]
    lines = [
        *constants,
        *limits,
        "return {",
        *(f"  {line}," for line in held),
        f"  linear: {json.dumps(cls.is_harmonic)},",
        f"  cubic: {json.dumps(one.anharmonic_order == 3)},",
        f"  energy: {_function(cls.energy)},",
        f"  curvature: {_function(one.curvature_kernel)},",
        "  forces(strains, forces) {",
        "    for (let i = 0; i < strains.length; i++) {",
        "      const strain = strains[i];",
        *(f"      {line}" for line in _body(kernel, "forces[i] = {};")),
        "    }",
        "  },",
        "};",
    ]
    inside = textwrap.indent("\n".join(lines), "    ")
    return f"({{ {given} }}) => {{\n{inside}\n  }}"


def _differs(cls: type[NamedBond], name: str) -> bool:
    return getattr(cls, name) is not getattr(Potential, name)


def _value(cls: type[NamedBond], name: str) -> str:
    """Return a limit of a bond in JavaScript, as a number or as the formula of a property."""
    found = inspect.getattr_static(cls, name)
    if not isinstance(found, property):
        return json.dumps(found)
    assert found.fget is not None
    return f"({_function(found.fget)})()"


def _function(function: Callable) -> str:
    parameters = [name for name in inspect.signature(function).parameters if name != "self"]
    return f"({', '.join(parameters)}) => {{ {' '.join(_body(function, 'return {};'))} }}"


def _body(function: Callable, result: str) -> list[str]:
    """Return the statements of a function in JavaScript; `result` gets the returned value."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
    assert isinstance(tree, ast.FunctionDef)
    return [line for statement in tree.body for line in _statement(statement, result)]


def _statement(statement: ast.stmt, result: str) -> list[str]:
    match statement:
        case ast.Expr(value=ast.Constant()):
            return []  # A docstring is not translated.
        case ast.Assign(targets=[ast.Name(id=name)], value=value):
            text = _expression(value)
            return [] if text == name else [f"const {name} = {text};"]
        case ast.Return(value=ast.expr() as value):
            return [result.format(_expression(value))]
        case ast.If(test=test, body=body, orelse=[]):
            inside = " ".join(line for each in body for line in _statement(each, result))
            return [f"if ({_expression(test)}) {{ {inside} }}"]
    raise TypeError(f"'{ast.unparse(statement)}' in a bond's formula has no translation")


def _expression(node: ast.expr) -> str:
    match node:
        case ast.Constant(value=int() | float() as value):
            return json.dumps(value)
        case ast.Attribute(value=ast.Name(id="math"), attr="inf"):
            return "Infinity"
        # Attributes of an object become plain names.
        case ast.Attribute(attr=name) | ast.Name(id=name):
            return name
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return f"(-{_expression(operand)})"
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return f"power({_expression(left)}, {_expression(right)})"
        case ast.BinOp(left=left, op=op, right=right):
            return f"({_expression(left)} {_OPERATORS[type(op)]} {_expression(right)})"
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            return f"({_expression(left)} {_COMPARISONS[type(op)]} {_expression(right)})"
        case ast.Call(func=ast.Attribute(attr="asarray"), args=[argument]):
            return _expression(argument)
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=arguments):
            # Kernels call the functions in their closure by short names.
            return f"{_CALLS[name]}({', '.join(map(_expression, arguments))})"
    raise TypeError(f"'{ast.unparse(node)}' in a bond's formula has no translation")
