"""The paper's slips: what is printed, what is right, and a check computed anew each time."""

from chaincor.workflows.reproduce.slips.harmonic_chains import harmonic_slips
from chaincor.workflows.reproduce.slips.nonlinear_chains import nonlinear_slips
from chaincor.workflows.reproduce.slips.slip import Kind, Matters, Slip


def all_slips() -> tuple[Slip, ...]:
    """Re-derive the paper's equations numerically, in the order of the paper."""
    return harmonic_slips() + nonlinear_slips()


def count_slips(slips: tuple[Slip, ...]) -> str:
    """Say how many slips there are, and how many entries are none."""
    number = {kind: sum(slip.kind is kind for slip in slips) for kind in Kind}
    counted = [slip.matters for slip in slips if slip.kind is Kind.SLIP]
    return (
        f"{number[Kind.SLIP]} slips: {counted.count(Matters.NOTHING)} misprints or conventions "
        f"without consequence, {counted.count(Matters.NUMBER)} that change a number, "
        f"{counted.count(Matters.STATEMENT)} of statements. {number[Kind.FOLLOWS]} more are "
        f"{Kind.FOLLOWS}, {number[Kind.APPROXIMATION]} is an {Kind.APPROXIMATION}, "
        f"{number[Kind.REMARK]} is a remark; of what was suspected besides, {number[Kind.RIGHT]} "
        f"are right as printed and {number[Kind.UNDECIDED]} is undecided. Numbers are "
        "among the verdicts as well: α, those in brackets, and C twice, for its digits and for how "
        "it follows"
    )


def slips_page(slips: tuple[Slip, ...]) -> str:
    """Write the slips as Markdown, the page ``docs/paper_slips.md``."""
    parts = [
        "# Slips of the paper\n\n"
        "S. Nagahiro and Y. Hayakawa, *Collision of one-dimensional nonlinear chains*, "
        "Phys. Rev. E 67, 036609 (2003), derived again equation by equation. Equations are "
        "counted as in its source. The checks are in "
        "`workflows/reproduce/slips/harmonic_chains.py` and "
        "`nonlinear_chains.py` beside it; a test makes them again and compares this page with "
        f"their output.\n\n{count_slips(slips)}.\n"
    ]
    for number, slip in enumerate(slips, start=1):
        correct = slip.correct or "as printed: it was suspected, and is right"
        kind = "" if slip.kind in (Kind.SLIP, Kind.RIGHT) else f" ({slip.kind})"
        matters = f"- Matters: {slip.matters}\n" if slip.kind is Kind.SLIP else ""
        parts.append(
            f"\n## {number}. {slip.where}{kind}\n\n- Printed: {slip.printed}\n"
            f"- Correct: {correct}\n{matters}- Evidence: {slip.evidence}\n"
        )
    return "".join(parts)
