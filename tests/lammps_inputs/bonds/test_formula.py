"""Test bonds by formula: allowed text, digits, natural length, and refusals."""

import math
import pickle
import re
import string

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from chaincor.lammps_inputs.bonds.formula import Formula, formula_bond
from chaincor.lammps_inputs.bonds.formula_text import canonical_text, check_parameters
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic, Morse, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.errors import PotentialError
from tests.waiting import must_end

MORSE = "D*(1-exp(-a*s))^2"
NAMED = [
    (MORSE, {"D": 1.0 / 72.0, "a": 6.0}, Morse(6.0)),
    ("(r^-12 - 2*r^-6 + 1)/72", {}, LennardJones()),
    ("(exp(-b*s) - 1 + b*s)/b^2", {"b": 10.0}, Toda(10.0)),
    ("s - log(1 + s)", {}, Logarithmic()),
    ("s^2/2 + c*s^4", {"c": 1.0}, Power(4, 1.0)),
    ("s^2/2 - s^3", {}, Power(3, -1.0)),
    ("s^2/2", {}, Harmonic()),
]
each_named = pytest.mark.parametrize(
    ("text", "parameters", "named"), NAMED, ids=[named.name for *_, named in NAMED]
)


@each_named
def test_formulas_of_the_named_bonds_are_these_bonds(text, parameters, named):
    bond = Formula(text, parameters)
    sizes = np.geomspace(1e-14, 2.0, 300)
    strains = np.concatenate((sizes, -sizes[sizes < 0.9]))
    # Series are used at strains below 0.03 or more. There, terms of the formula that are a few
    # times the stiffness cancel, with relative errors of a few eps/0.03 in the force and eps/0.03^2
    # in the energy. In tension, the force of a morse bond, named or not, has an absolute error of
    # about eps.
    force, energy = named.force(strains), named.energy(strains)
    assert np.all(
        np.abs(bond.force(strains) - force) <= 3e-14 * np.maximum(abs(force), 1e-3 * abs(strains))
    )
    assert np.all(
        np.abs(bond.energy(strains) - energy) <= 1e-12 * np.maximum(abs(energy), 1e-3 * strains**2)
    )
    # The curvature of lj has terms of 13/6 and 7/6 times the stiffness.
    curvature = named.curvature(strains)
    assert bond.curvature(strains) == pytest.approx(curvature, rel=1e-12, abs=1e-13)
    assert bond.natural_speed == (
        None if named.natural_speed is None else pytest.approx(named.natural_speed, rel=2e-12)
    )
    assert bond.dissociation == pytest.approx(named.dissociation, rel=1e-12)
    assert bond.barrier_strain == pytest.approx(named.barrier_strain, rel=1e-12)
    assert bond.anharmonic_order == named.anharmonic_order
    assert bond.stiffness == pytest.approx(1.0, rel=1e-14)
    assert bond.natural_length == 1.0
    # The convex strain of a formula is found by sampling and never overestimated.
    assert 0.9 * named.convex_strain <= bond.convex_strain <= named.convex_strain


def test_digits_at_the_slowest_speeds():
    # At 1e-12 v*, the plain formula of lj has a relative error of 1e-4.
    text, parameters = "4*eps*((sig/r)^12 - (sig/r)^6)", {"eps": 0.3, "sig": 0.9}
    bond = Formula(text, parameters)
    with mpmath.workdps(60):
        eps, sig = mpmath.mpf(0.3), mpmath.mpf(0.9)
        rest = 2 ** (mpmath.mpf(1) / 6) * sig

        def energy(x):
            return 4 * eps * ((sig / (rest + x)) ** 12 - (sig / (rest + x)) ** 6) + eps

        for share in (1e-12, 1e-6, 1e-3, 0.1):
            for side in (-1.0, 1.0):
                strain = side * share * bond.natural_speed / bond.stiffness**0.5
                x = mpmath.mpf(strain)
                force = -mpmath.diff(energy, x)
                # Errors of the series: rounding of the parameters, through k, and of the sum.
                assert abs(float(bond.energy(strain) / energy(x) - 1)) < 1e-13
                assert abs(float(bond.force(strain) / force - 1)) < 2e-14


def test_natural_length_and_stiffness_are_those_of_the_formula():
    bond = Formula("4*eps*((sig/r)^12 - (sig/r)^6)", {"eps": 0.5, "sig": 0.8})
    assert bond.natural_length == pytest.approx(0.8 * 2.0 ** (1.0 / 6.0), rel=1e-15)
    assert bond.stiffness == pytest.approx(72.0 * 0.5 / 2 ** (1.0 / 3.0) / 0.64, rel=1e-14)
    assert bond.dissociation == pytest.approx(0.5, rel=1e-12)
    assert (bond.energy(0.0), bond.force(0.0)) == (0.0, 0.0)
    # Reduced units turn this bond into lj, so that a depth D multiplies v* of lj by sqrt(72 D).
    ratio = bond.natural_speed / LennardJones().natural_speed
    assert ratio == pytest.approx(math.sqrt(72.0 * 0.5), rel=3e-12)
    # Particles coincide at length zero of the bond. For a bond longer than 1, this is at strain -1
    # at the latest.
    assert bond.strain_min == pytest.approx(-bond.natural_length, rel=1e-12)
    assert Formula("(r - 1.25)^2", {}).strain_min == -math.inf


def test_a_kernel_serves_all_values_of_the_parameters():
    first, second = (Formula(MORSE, {"D": 0.01, "a": a}) for a in (3.0, 7.0))
    assert first.force_kernel is second.force_kernel
    other = Formula("D*(1-exp(-a*s))^2 + s^4", {"D": 0.01, "a": 3.0})
    assert other.force_kernel.__qualname__ != first.force_kernel.__qualname__
    strains = np.concatenate((np.linspace(-0.5, 2.0, 101), np.geomspace(1e-14, 1e-2, 50)))
    for bond in (first, second):
        single = [float(bond.force_kernel(float(s), bond.parameters)) for s in strains]
        # Exponentials and powers of Python and NumPy may round differently, by an eps of terms that
        # are much larger than the force.
        assert bond.force(strains) == pytest.approx(single, rel=1e-13, abs=1e-18)


def test_the_same_formula_is_the_same_object_also_from_another_process():
    bond = formula_bond(MORSE, (("D", 0.0139), ("a", 6.0)))
    assert formula_bond(MORSE, (("D", 0.0139), ("a", 6.0))) is bond
    assert pickle.loads(pickle.dumps(bond)).natural_speed == bond.natural_speed
    assert canonical_text("D * ((1 - exp(-(a*s)))) ** 2") == canonical_text(
        "D*(1-exp( -(a * s) ))^2"
    )


def test_barriers_and_ends_of_a_formula():
    assert Formula("-cos(s)", {}).barrier_strain == pytest.approx(math.pi, rel=1e-12)
    assert Formula("s^2/2 + s^3", {}).strain_min == pytest.approx(-1.0 / 3.0, rel=1e-12)
    assert Formula("s^2/2 + 1e-3/(0.3 - s)", {}).strain_max == pytest.approx(
        0.3 - Formula("s^2/2 + 1e-3/(0.3 - s)", {})._rest, rel=1e-9
    )
    # The energy is finite at length zero: particles can pass through each other, which engines
    # detect.
    assert Formula("(s + 1)^2.5 - 2.5*s", {}).strain_min == -math.inf


HOSTILE = {
    "__import__('os').system('x')": "has the character",
    "s.__class__": "contains Attribute",
    "().__class__.__bases__*s": "contains Attribute",
    "lambda s: s": "has the character ':'",
    "s if s else s": "contains IfExp",
    "s and r": "contains BoolOp",
    "not s": "contains UnaryOp",
    "s//2": "has the operator FloorDiv",
    "exp(s,s)": "Write exp(x) with one argument",
    "exp + s": "uses 'exp', a function",
    "exp(exp)*s": "uses 'exp'",
    "s(s)": "calls 's'",
    "print(s)": "calls 'print'",
    "abs(s)": "Use one of exp",
    "1j*s": "contains Constant",
    "s*True": "contains Constant",
    "...*s": "contains Constant",
    "s^2\nshell rm -rf": "has the character '\\n'",
    "s^2 ${x}": "has the character '$'",
    "s²": "has the character",
    "ｓ^2": "has the character",
    "s\0": "has the character",
    "s^^2": "cannot be read",
    "(": "cannot be read",
    "": "cannot be read",
    "import os": "cannot be read",
    "s + x": "uses 'x', an unknown parameter",
    "2 + 3": "does not depend on the strain",
    "s^9^9^9^9": "has no finite value",
    "s*9**9**9**9": "has no finite value",
    "s^100": "has the power 100",
    "s*1e400": "contains the number inf",
    "log(-1)*s": "has no finite value",
    "s/0": "has no finite value",
    "1/(s-s)": "has no finite value",
    "(-2)^s": "powers of positive numbers",
    "sqrt(s^2)": "has a kink",
    "s" * 401: "has 401 characters",
    "s+" * 199 + "s": "at most 160 numbers",
    "(" * 150 + "s" + ")" * 150 + "+" + "-" * 30 + "s": "is nested too deeply",
    "tanh(" * 20 + "s" + ")" * 20: "more than 3000 operations",
    "s^4": "no stable natural length",
    "-s^2": "no stable natural length",
    "(r - 10)^2": "Scale lengths",
    "1e20*s^2": "has the stiffness 2e+20",
    "(1e7 + s)^2 - 1e14 - 2e7*s": "energy",
    "cosh(1000*s) + 1e9*s^2 - 1e9*s^2*cos(1e-3*s)": "energy",
    "s^2/2 + 1/(s^2 - 0.6*s + 0.09)": "energy",
    "-cos(1e6*s)": "energy",
}


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_what_is_no_formula_is_refused_in_one_line(text):
    # Without the refusal, some of these formulas would take hours.
    with must_end(), pytest.raises(PotentialError) as refused:
        Formula(text, {})
    message = str(refused.value)
    assert HOSTILE[text] in message
    assert message.isprintable()
    assert re.search(r"\. (Give|Rewrite|Scale|Shorten|Use|Remove|Write) ", message)


_PIECES = [*string.ascii_lowercase[:6], "s", "r", "D", *"0129.+-*/^(),_' \n[]{}:=@", "exp(", "1e3"]


@settings(max_examples=150, deadline=None)
@given(text=st.lists(st.sampled_from(_PIECES), max_size=20).map("".join))
@example(text="9^9^9^9^9*s")
def test_any_text_is_a_bond_or_one_line(text):
    line = None
    try:
        bond = Formula(text, {})
    except PotentialError as error:
        line = str(error)
    if line is None:
        assert bond.stiffness > 0.0
        assert bond.force(0.0) == 0.0
    else:
        assert line.isprintable()


@pytest.mark.parametrize(
    ("given_", "line"),
    [
        ({"s": 1.0}, "'s' means something else"),
        ({"exp": 1.0}, "'exp' means something else"),
        ({"pi": 3.0}, "'pi' means something else"),
        ({"_x": 1.0}, "cannot be the name"),
        ({"lambda": 1.0}, "cannot be the name"),
        ({"é": 1.0}, "cannot be the name"),
        ({1: 1.0}, "cannot be the name"),
        ({"a": True}, "a is True. Give a number"),
        ({"a": "6"}, "a is '6'. Give a number"),
        ({"a": math.nan}, "a is nan. Give a finite number"),
        ({"a": math.inf}, "a is inf. Give a finite number"),
        ({"a": 10**400}, "Give a finite number"),
        ({"a": 1e-200}, "Give a finite number"),
        ([1.0], "Give names and numbers"),
        ({f"a{k}": 1.0 for k in range(30)}, "at most 20"),
    ],
)
def test_parameters_are_names_and_finite_numbers(given_, line):
    with pytest.raises(ValueError, match="Give ") as refused:
        check_parameters(given_)
    assert line in str(refused.value)
