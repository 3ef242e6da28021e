"""
Test that every slip's check gives its statement, and that the page of slips is current.

``python -m tests.workflows.reproduce.slips.test_slips`` writes the page again.
"""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from chaincor.analysis import pair_theory, restitution, theory
from chaincor.workflows.reproduce.paper import CLAIMS
from chaincor.workflows.reproduce.report import read_slips
from tests.workflows.reproduce.slips import harmonic_chains, nonlinear_chains
from tests.workflows.reproduce.slips.slip import Kind, Matters, Slip

PAGE = Path(__file__).parents[4] / "docs" / "paper_slips.md"

# The numbered equations of the paper, in their order in its source.
EQUATIONS = (
    "coefficient of restitution",
    "Hamiltonian",
    "restitution by vibration",
    "equation of motion",
    "matrix A",
    "initial state",
    "mode energies",
    "interval",
    "contacts",
    "incoming speed",
    "dispersion",
    "harmonic law",
    "Hamiltonian of two",
    "initial state of two",
    "interval of two",
    "mode energies at low speed",
    "linear dispersion",
    "low-speed law",
    "bond of any order",
    "power law",
)
NUMBER = {name: number for number, name in enumerate(EQUATIONS, start=1)}


@cache
def all_slips() -> tuple[Slip, ...]:
    """Re-derive the paper's equations numerically, in the order of the paper."""
    return harmonic_chains.harmonic_slips() + nonlinear_chains.nonlinear_slips()


def count_slips(slips: tuple[Slip, ...]) -> str:
    """Return a text with the numbers of slips and of entries that are no slips."""
    number = {kind: sum(slip.kind is kind for slip in slips) for kind in Kind}
    counted = [slip.matters for slip in slips if slip.kind is Kind.SLIP]
    return (
        f"{number[Kind.SLIP]} slips: {counted.count(Matters.NOTHING)} misprints or conventions "
        f"without consequence, {counted.count(Matters.NUMBER)} that change a number, and "
        f"{counted.count(Matters.STATEMENT)} wrong statements. {number[Kind.FOLLOWS]} more entries "
        f"are {Kind.FOLLOWS}. {number[Kind.APPROXIMATION]} entry is an {Kind.APPROXIMATION}, and "
        f"{number[Kind.REMARK]} is a remark. {number[Kind.RIGHT]} suspected entries are right as "
        f"printed, and {number[Kind.UNDECIDED]} is undecided. The verdicts on claims also judge α, "
        "the numbers in brackets, and C"
    )


def slips_page(slips: tuple[Slip, ...]) -> str:
    """Write the slips as Markdown, the page ``docs/paper_slips.md``."""
    parts = [
        "# Slips of the paper\n\n"
        "This page lists slips in S. Nagahiro and Y. Hayakawa, *Collision of one-dimensional "
        "nonlinear chains*, Phys. Rev. E 67, 036609 (2003). Equations have the numbers of the "
        "paper's source. The tests in `tests/workflows/reproduce/slips/` derive each equation "
        f"again, check each entry and write this page.\n\n{count_slips(slips)}.\n"
    ]
    for number, slip in enumerate(slips, start=1):
        is_slip = slip.kind is Kind.SLIP
        parts.append(
            f"\n## {number}. {slip.where}\n\n- Printed: {slip.printed}\n- Correct: "
            + (slip.correct or "as printed")
            + (f"\n- Matters: {slip.matters}" if is_slip else f"\n- Kind: {slip.kind}")
            + f"\n- Evidence: {slip.evidence}\n"
        )
    return "".join(parts)


def test_every_slip_is_confirmed():
    assert [slip.where for slip in all_slips() if not slip.confirmed] == []


def test_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == slips_page(all_slips())


def test_report_reads_the_page_as_it_was_written():
    count, read = read_slips()
    assert count == count_slips(all_slips())
    names = ("where", "printed", "correct", "kind", "evidence")
    for ours, theirs in zip(all_slips(), read, strict=True):
        assert [theirs[name] for name in names] == [getattr(ours, name) for name in names]
        assert theirs["matters"] == (ours.matters if ours.kind is Kind.SLIP else "–")


def test_what_is_right_or_undecided_is_no_slip():
    slips = all_slips()
    kinds = {slip.where: slip.kind for slip in slips}
    assert kinds["eq. (7)"] is kinds["eq. (12)"] is Kind.RIGHT
    assert kinds["figure 2"] is Kind.UNDECIDED
    assert kinds["eqs. (7)–(10) together"] is Kind.APPROXIMATION
    assert kinds["eq. (18)"] is Kind.FOLLOWS
    for slip in slips:
        assert (slip.kind is Kind.RIGHT) == (slip.correct == "")
    assert kinds["section III, last paragraphs"] is Kind.REMARK


def test_slips_are_counted_by_what_follows_from_them():
    counted = [slip for slip in all_slips() if slip.kind is Kind.SLIP]
    numbers = {slip.where for slip in counted if slip.matters is Matters.NUMBER}
    assert numbers == {"eqs. (8), (9), numbers in brackets", "eqs. (16), (18)"}
    trifles = {slip.where for slip in counted if slip.matters is Matters.NOTHING}
    assert {"eq. (15)", "after eq. (17)", "below eq. (7)"} < trifles
    others = len(counted) - len(numbers) - sum(s.matters is Matters.NOTHING for s in counted)
    found = re.findall(r"\d+", count_slips(all_slips()))[:4]
    assert [int(n) for n in found] == [len(counted), len(counted) - others - 2, 2, others]


def test_no_rounding_residue_is_shown():
    # Residuals of identities differ between processors, so that the page shows bounds.
    for slip in all_slips():
        for bound, number in re.findall(r"(below )?(\d(?:\.\d+)?e-\d+)", slip.evidence):
            assert bound or float(number) > 1e-9, slip.evidence


@pytest.mark.parametrize("module", [harmonic_chains, nonlinear_chains])
def test_every_verdict_is_computed(module):
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    calls = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Slip"
    ]
    assert len(calls) > 5
    for call in calls:
        assert len(call.args) == 5
        assert any(isinstance(node, ast.Name) for node in ast.walk(call.args[4])), ast.unparse(call)


@pytest.mark.parametrize(
    ("documented", "names"),
    [
        (restitution.restitution, ["coefficient of restitution"]),
        (theory.contact_mode_energies, ["mode energies"]),
        (theory.basile_dumont_energies, ["mode energies", "mode energies at low speed"]),
        (theory.harmonic_dissipation_law, ["harmonic law"]),
        (theory.low_speed_dissipation_slope, ["low-speed law"]),
        (pair_theory.pair_interval_slope, ["interval of two"]),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_docstrings_count_equations_as_the_paper_does(documented, names):
    cited = re.findall(r"eq\. \((\d+)\)", documented.__doc__)
    assert [int(number) for number in cited] == [NUMBER[name] for name in names]


def test_rules_count_equations_as_the_paper_does():
    named = {
        "interval": "interval",
        "interval of two": "interval",
        "contacts of two": "contacts",
        "speed of two": "incoming speed",
        "contacts per particle": "contacts",
        "incoming speed": "incoming speed",
        "harmonic exponent": "harmonic law",
        "harmonic prefactor": "harmonic law",
        "formula prefactor": "harmonic law",
        "alpha": "interval of two",
        "printed constant": "low-speed law",
        "theoretical slope": "low-speed law",
        **dict.fromkeys(("power r = 3", "power r = 4", "power r = 5"), "power law"),
    }
    cited = {rule.key: rule.where for rule in CLAIMS if rule.where.startswith("eq.")}
    assert cited == {key: f"eq. ({NUMBER[name]})" for key, name in named.items()}


if __name__ == "__main__":
    PAGE.write_text(slips_page(all_slips()), encoding="utf-8")
