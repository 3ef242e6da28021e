"""Find why two runs differ from the beginning."""

import re

from chaincor.workflows.scripts.change import draws_forces
from chaincor.workflows.scripts.matching import Match
from chaincor.workflows.scripts.script_text import Command
from chaincor.workflows.scripts.varied import RANKS, RESTART, Varied


def find_causes(varied: Varied, match: Match) -> tuple[str, ...]:
    """Return the likely causes of an early difference, with the likeliest cause first."""
    commands = varied.script.commands
    found: list[str] = []
    if not match.same_places:
        placed = [c for c in commands if _places_at_random(c)]
        found += [f"{c} places particles at random" for c in placed]
        found.append("the runs begin with different positions, so their set-ups differ")
    elif not match.same_speeds:
        if match.renumbered:
            found.append(
                "LAMMPS numbered the particles differently (create_atoms numbers them by "
                "process), and velocities are drawn by number: add 'loop geom' to 'velocity "
                "create', or read the particles from a file"
            )
        else:
            drawn = [c for c in commands if c.words[0] == "velocity" and "local" in c.words]
            found += [f"{c} draws velocities by process: leave out 'loop local'" for c in drawn]
            found.append("the runs begin with different velocities")
    drawn = [c for c in commands if draws_forces(c.words)]
    why = {
        RANKS: "draws random numbers on each process",
        RESTART: "draws random numbers, and a restart file does not contain their state",
    }
    if varied.kind in why:
        found += [f"{c}, '{' '.join(c.words[:4])}', {why[varied.kind]}" for c in drawn]
    if varied.kind == RESTART:
        found += [f"{c} counts steps: {c.text.strip()}" for c in commands if _depends_on_step(c)]
    if not found:
        found.append("the script shows no cause; look for a bug or a different set-up")
    return tuple(found)


def _places_at_random(command: Command) -> bool:
    words = command.words
    return words[0] in ("create_atoms", "displace_atoms", "delete_atoms") and "random" in words


def _depends_on_step(command: Command) -> bool:
    words = command.words
    return words[0] == "variable" and re.search(r"\b(elapsed|step)\b", command.text) is not None
