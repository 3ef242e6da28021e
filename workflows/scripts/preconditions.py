"""Refuse scripts whose timestep cannot be judged, and say what to change."""

import re
from collections.abc import Iterable

import numpy as np

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.samples import Samples
from chaincor.workflows.scripts.script_text import Command, ScriptText
from chaincor.workflows.scripts.step_counts import plain_style

# LAMMPS warns with this message if a run has no fix that integrates.
_STANDS_STILL = re.compile(r"WARNING: No fixes with time integration")
# LAMMPS warns with this message if two fixes integrate the same atoms.
_MOVES_TWICE = re.compile(r"WARNING: One or more atoms are time integrated more than once")
_INTEGRATORS = ("nve", "nvt", "npt", "nph", "rigid", "move", "brownian", "bd/", "poems")
# At the end of each run, LAMMPS prints the number of atoms.
_ATOMS = re.compile(r"^Loop time of .* with (\d+) atoms?", re.MULTILINE)
_RUNS = re.compile(r"\brun\b")


def check_steps_of_script(script: ScriptText, command: str) -> None:
    """
    Raise InputError if a script has no run, or chooses its timestep itself.

    The message contains `command`, the study's command.
    """
    found = script.commands
    if script.whole and not any(_RUNS.search(each.text) for each in found):
        other = next((each for each in found if each.words[0] == "minimize"), None)
        only = "" if other is None else f", only 'minimize' ({other})"
        raise InputError(
            f"{script.path.name} has no 'run'{only}, so no atom moves and the timestep has no "
            "effect. Add a 'run'"
        )
    chooser = next((each for each in found if _chooses_step(each)), None)
    if chooser is not None:
        raise InputError(
            f"'{' '.join(chooser.words[:4])}' ({chooser}) chooses the timestep, so no ladder can "
            "vary it. Remove this line to judge constant timesteps, then run: "
            f"{command}"
        )


def check_motion(
    script: ScriptText, lengths: Iterable[tuple[int, int]], samples: Samples | None, screen: str
) -> None:
    """
    Raise InputError if nothing moves in a run of a script, or if atoms move twice in a step.

    `lengths` gives the first step and the number of steps for each run. `screen` is LAMMPS's
    output.
    """
    name, counts = script.path.name, [count for _, count in lengths]
    if counts and not any(counts):
        raise InputError(f"{name} runs 0 steps. Give its 'run' a number of steps")
    if _MOVES_TWICE.search(screen):
        found = [c for c in script.commands if _integrates(c)]
        said = "".join(f"; {c} is '{' '.join(c.words[:4])}'" for c in found)
        raise InputError(
            f"{name} integrates some atoms more than once per step{said}. Keep one of these fixes "
            "for each atom"
        )
    if counts and len(_STANDS_STILL.findall(screen)) >= len(counts):
        raise InputError(
            f"{name} has no fix that integrates, so no atom moves and the timestep has no effect. "
            "Add a fix such as 'fix 1 all nve'"
        )
    if samples is not None and _is_at_rest(samples, screen):
        raise InputError(
            f"no particle of {name} ever moves: the kinetic energy is 0 at all times, so the "
            "timestep has no effect. Give velocities, or move particles until forces act"
        )


def _is_at_rest(samples: Samples, screen: str) -> bool:
    """Return whether the kinetic energy is 0 and all other sampled quantities are constant."""
    # LAMMPS's kinetic energy excludes the motion of the centre of mass, so it is 0 for one atom.
    atoms = [int(each) for each in _ATOMS.findall(screen)]
    if not atoms or min(atoms) < 2:
        return False
    energies = samples.values.get("ke", np.ones(1))
    return not np.any(energies) and not any(np.any(np.diff(x)) for x in samples.values.values())


def _integrates(command: Command) -> bool:
    words = command.words
    return words[0] == "fix" and len(words) > 3 and words[3].startswith(_INTEGRATORS)


def _chooses_step(command: Command) -> bool:
    words = command.words
    return words[0] == "fix" and len(words) > 3 and plain_style(words[3]) == "dt/reset"
