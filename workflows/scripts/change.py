"""Change a script's step, variables, cutoff, seeds and periods for one run."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.workflows.scripts.restarting import Halfway
from chaincor.workflows.scripts.step_counts import count_positions, plain_style

_TABLES = ("pair_style", "bond_style", "angle_style")
# _STYLE_AT gives the index of the word that names a command's style. For commands that draw random
# forces, _FORCES gives the index of the word that is the seed.
_STYLE_AT = {
    "fix": 3, "pair_style": 1, "velocity": 2, "create_atoms": 2, "displace_atoms": 2, "set": 3,
}  # fmt: skip
_FORCES = {
    "fix langevin": 7, "fix langevin/eff": 7, "fix langevin/spin": 6, "fix temp/csvr": 7,
    "fix temp/csld": 7, "fix gle": 7, "fix ffl": 7, "fix brownian": 5, "fix ttm": 4, "fix tfmc": 6,
    "fix gcmc": 8, "fix widom": 7, "fix atom/swap": 6, "fix mol/swap": 8, "fix bond/swap": 7,
    "pair_style dpd": 4, "pair_style dpd/ext": 4, "pair_style dpd/fdt": 4,
    "pair_style dpd/tstat": 5, "pair_style mdpd": 4, "pair_style brownian": 8,
}  # fmt: skip
# This table gives the index of the seed for commands that draw an initial state or insert
# particles.
_STARTS = {
    "fix deposit": 7, "fix pour": 6, "velocity create": 4, "create_atoms random": 4,
    "displace_atoms random": 6, "set type/fraction": 6, "set type/ratio": 6,
}  # fmt: skip
_LARGEST_SEED = 900_000_000


@dataclass(frozen=True)
class Change:
    """Changes that one run makes to a script."""

    finer: float = 1.0  #: Number of steps that replace one step of the script; 2 halves the step.
    #: Sampled quantities, with their names in LAMMPS's formulas: ``etotal``, ``c_1``, ``v_x``.
    quantities: tuple[str, ...] = ()
    #: Values of the script's own variables, as text.
    variables: Mapping[str, str] = field(default_factory=dict)
    #: New values of ``cutoff``, ``skin`` and ``rows``, as text.
    settings: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None  #: Number that is added to seeds; None leaves the seeds unchanged.
    #: Whether only the seeds of random forces change, and not those of initial states.
    forces_alone: bool = False
    scale_periods: bool = False  #: Whether periods that count steps keep their simulated time.
    #: Fraction of the box length by which all particles are displaced before the first run.
    shaken: float = 0.0
    frames: bool = False  #: Whether positions are written with the samples.
    restart: Halfway | None = None  #: Restart file that the run writes or reads halfway.
    #: Commands that are added before each ``run``.
    extra: tuple[str, ...] = ()
    #: Whether a quantity is read from the script's output. The thermo output then stays unchanged.
    printed: bool = False

    def set_numbers(self, words: list[str]) -> list[str]:
        """
        Change the cutoff, skin, table rows, seeds and periods of a command in place.

        The returned commands must precede the changed command.
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


def draws_forces(words: list[str]) -> bool:
    """Return whether a command draws random numbers during the run."""
    place = _STYLE_AT.get(words[0], len(words))
    style = plain_style(words[place]) if place < len(words) else ""
    return f"{words[0]} {style}" in _FORCES or (words[0] == "fix" and "langevin" in words[4:])


def _seed(words: list[str], added: int, forces_alone: bool) -> list[str]:
    """
    Increase the seed in a command.

    If the seed is the value of a variable, return the lines that must precede the command.
    """
    place = _STYLE_AT.get(words[0], len(words))
    seeds = _FORCES if forces_alone else _FORCES | _STARTS
    at = seeds.get(f"{words[0]} {plain_style(words[place])}") if place < len(words) else None
    if words[0] == "fix" and "langevin" in words[4:]:
        # A fix for rigid bodies names its thermostat after other keywords.
        at = words.index("langevin", 4) + 4
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
    """Multiply the step counts in a command by `finer`, and return lines that must precede it."""
    lines: list[str] = []
    first = ""
    for at in count_positions(words):
        count = f"chaincor_c{at}"
        lines.append(f"variable {count} string {words[at]}")
        least = "0" if words[at - 1] == "delay" else "1"
        formula = f"round(v_{count}*{finer:.17g})"
        if first and words[0] == "fix":
            # The second count must stay the same multiple of the first count.
            formula = f"v_{first}x*round(v_{count}/v_{first})"
        lines.append(f"variable {count}x string $({formula}:%.15g)")
        lines.append(f"variable {count}x string $(ternary(v_{count}x<{least},{least},v_{count}x))")
        words[at] = f"${{{count}x}}"
        first = first or count
    return lines
