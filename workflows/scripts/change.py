"""What one run does otherwise than the script says: step, variables, cutoff, seeds, periods."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.workflows.scripts.step_counts import count_positions, plain_style

_TABLES = ("pair_style", "bond_style", "angle_style")
# Which word of a command is a seed, from 0: by the style of a fix, or by what stands where. These
# draw random numbers as the run goes on.
_FIXES = {
    "langevin": 7, "langevin/eff": 7, "langevin/spin": 6, "temp/csvr": 7, "temp/csld": 7, "gle": 7,
    "ffl": 7, "brownian": 5, "ttm": 4, "tfmc": 6, "gcmc": 8, "widom": 7, "atom/swap": 6,
    "mol/swap": 8, "bond/swap": 7,
}  # fmt: skip
_PAIRS = {"dpd": 4, "dpd/ext": 4, "dpd/fdt": 4, "dpd/tstat": 5, "mdpd": 4, "brownian": 8}
_FORCES = {("pair_style", 1, style): place for style, place in _PAIRS.items()}
# And these a start, or what comes in at its time.
_FIXES_OF_STARTS = {"deposit": 7, "pour": 6}
_STARTS = {
    ("velocity", 2, "create"): 4, ("create_atoms", 2, "random"): 4,
    ("displace_atoms", 2, "random"): 6, ("set", 3, "type/fraction"): 6, ("set", 3, "type/ratio"): 6,
}  # fmt: skip
_LARGEST_SEED = 900_000_000


@dataclass(frozen=True)
class Change:
    """What one run does otherwise than the script says."""

    finer: float = 1.0  #: Steps for each step of the script: 2 halves the step. 1 leaves it.
    #: What is sampled, as in formulas of LAMMPS: ``etotal``, ``c_1``, ``v_x``.
    quantities: tuple[str, ...] = ()
    #: Values of the script's own variables, as text.
    variables: Mapping[str, str] = field(default_factory=dict)
    #: Of ``cutoff``, ``skin`` and ``rows``: what they shall be, as text.
    settings: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None  #: Added to seeds.
    #: Whether only to those of what draws random numbers as the run goes on: a thermostat's, and
    #: not those that a start is drawn with.
    forces_alone: bool = False
    scale_periods: bool = False  #: Whether numbers of steps are held in time.
    #: Share of the box by which all particles are displaced before the first run.
    shaken: float = 0.0
    frames: bool = False  #: Whether positions are written with the samples.
    #: Whether a number is read from what the script prints, and all thermo output stays.
    printed: bool = False

    def set_numbers(self, words: list[str]) -> list[str]:
        """
        Give a command, in place, the cutoff, skin, table rows, seeds and periods that are wanted.

        Returns commands that must stand before it.
        """
        settings = self.settings
        if "skin" in settings and words[0] == "neighbor" and len(words) > 1:
            words[1] = settings["skin"]
        if "cutoff" in settings and words[0] == "pair_style" and "hybrid" not in words[1]:
            at = next((k for k in range(2, len(words)) if number_in(words[k]) is not None), None)
            if at is not None:
                words[at] = settings["cutoff"]
        if "rows" in settings and words[0] in _TABLES and "table" in words[:-2]:
            words[words.index("table") + 2] = settings["rows"]
        before = [] if self.seed is None else _seed(words, self.seed, self.forces_alone)
        if self.scale_periods and self.finer != 1.0:
            before += _scale(words, self.finer)
        return before


def _seed(words: list[str], added: int, forces_alone: bool) -> list[str]:
    """Add to the seed in a command; returns lines before it, where that is a variable's value."""
    fixes = _FIXES if forces_alone else _FIXES | _FIXES_OF_STARTS
    others = _FORCES if forces_alone else _FORCES | _STARTS
    at = fixes.get(plain_style(words[3])) if words[0] == "fix" and len(words) > 3 else None
    if words[0] == "fix" and "langevin" in words[4:]:
        # A thermostat of rigid bodies.
        at = words.index("langevin", 4) + 4
    for (command, place, style), position in others.items():
        if words[0] == command and words[place : place + 1] == [style]:
            at = position
    if at is None or at >= len(words):
        return []
    if words[at].isdigit():
        words[at] = str((int(words[at]) + added) % _LARGEST_SEED + 1)
        return []
    if "$" not in words[at]:
        return []
    given, words[at] = words[at], "${chaincor_seed}"
    formula = f"(v_chaincor_seed+{added})%{_LARGEST_SEED}+1"
    return [
        f"variable chaincor_seed string {given}",
        f"variable chaincor_seed string $({formula}:%.15g)",
    ]


def _scale(words: list[str], finer: float) -> list[str]:
    """Let numbers of steps in a command be so many times larger; returns lines before it."""
    lines: list[str] = []
    first = ""
    for at in count_positions(words):
        count = f"chaincor_c{at}"
        lines.append(f"variable {count} string {words[at]}")
        least = "0" if words[at - 1] == "delay" else "1"
        formula = f"round(v_{count}*{finer:.17g})"
        if first and words[0] == "fix":
            # A multiple of the first, as many times as before.
            formula = f"v_{first}x*round(v_{count}/v_{first})"
        lines.append(f"variable {count}x string $({formula}:%.15g)")
        lines.append(f"variable {count}x string $(ternary(v_{count}x<{least},{least},v_{count}x))")
        words[at] = f"${{{count}x}}"
        first = first or count
    return lines
