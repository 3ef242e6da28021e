"""Render LAMMPS inputs. Each value is a number or a fixed name, never a user's text."""

import string
import textwrap
from dataclasses import asdict
from functools import cache
from typing import Any

from chaincor.lammps_inputs.bond_table import KEYWORDS, BondTable
from chaincor.lammps_inputs.contact_script import contact_values, number
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.own_templates.own_template import RENDERING
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.scene_parts.rules import SHORTEST_TIMESTEP, VERLET_STABILITY_LIMIT
from chaincor.lammps_inputs.script_plan import (
    NO_WISHES,
    EndTimes,
    ExpectedEnd,
    JobWishes,
    ScriptedSteps,
    ScriptPlan,
)
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem

DATA_FILE = "chain.data"
TABLE_FILE = "bond.table"
SCRIPT_FILE = "in.chain"
SCENE_FILE = "scene.toml"
DUMP_FILE = "dump.lammpstrj"
LOG_FILE = "log.lammps"
CONTACTS_FILE = "contacts.txt"
RESTART_FILE = "chain.restart"
STATE_FILE = "chain.state"

# Names that LAMMPS users give by -var by mistake, instead of velocity and timestep.
_MISSPELT = ("speed", "v0", "vel", "velo", "v", "dt", "h", "step", "time_step", "timesteps")
SAFE_PATH_CHARACTERS = frozenset(string.ascii_letters + string.digits + "./_+-")


@cache
def _environment() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("chaincor.lammps_inputs", "templates")
    # No escaping is needed, because the text is not HTML and contains no text of a user.
    return Environment(loader=loader, undefined=StrictUndefined, **RENDERING)


def rendered(template: str, values: dict[str, Any]) -> str:
    """Render a template of this package with values."""
    return str(_environment().get_template(f"{template}.in.j2").render(values))


def render_setup(numerics: Numerics, table: BondTable | None, folder: str) -> str:
    """
    Render the commands that set up a chain for a run driven from Python.

    `folder` contains the data file and the table. Raises SceneError if its name has characters that
    LAMMPS would interpret.
    """
    if not set(folder) <= SAFE_PATH_CHARACTERS:
        raise SceneError(
            f"the temporary folder is {folder!r}. Set TMPDIR to a path of letters, digits and ./_+-"
        )
    return rendered("setup", setup_values(numerics, table, folder))


def render_job(
    problem: Problem,
    plan: ScriptPlan,
    times: EndTimes,
    steps: ScriptedSteps | None = None,
    wishes: JobWishes = NO_WISHES,
) -> str:
    """Render a self-contained script for ``lmp -in``; without `steps`, it has Verlet steps."""
    values = setup_values(plan.numerics, plan.table, ".")
    values |= contact_values(problem, wishes.units)
    values |= values_in_units(problem, wishes.units)
    values |= _plan_values(problem, plan, steps, wishes.units)
    values |= _end_values(plan.end, times, values, wishes.units.time)
    values |= _wished_values(wishes)
    values |= _kept(values) | ({} if steps is None else asdict(steps))
    text = rendered("job", values)
    return text if wishes.template is None else wishes.template.render(values, text)


def setup_values(numerics: Numerics, table: BondTable | None, folder: str) -> dict[str, Any]:
    """Return the template values for the set-up, which all runs and scripts have."""
    return {
        "folder": folder,
        "data_file": DATA_FILE,
        "table_file": TABLE_FILE,
        "table_keyword": KEYWORDS[0],
        "far_keyword": KEYWORDS[1] if table is not None and table.far is not None else None,
        "tabulated": table is not None,
        "bond_style": "harmonic" if table is None else f"table {table.style} {table.rows}",
        "scripted": False,
        "restartable": False,
        "units": "lj",
        "reduced": True,
        "cutoff": "3.0",
        "spring": "0.5 1.0",
        "composed": False,
        "wall": numerics.wall,
        "timestep": number(numerics.timestep),
    }


def values_in_units(problem: Problem, units: UnitSystem) -> dict[str, Any]:
    """Return the template values of a scene, in the script's units."""
    targets = problem.line.targets
    return {
        "title": f"A chain of {problem.particles} particles with {_plain(problem.bond.name)} bonds "
        + ("meets a wall" if not targets else f"meets {targets} at rest"),
        "velocity": number(units.speed * problem.impact_velocity),
        "units": units.style,
        "reduced": units == CHAIN_UNITS,
        "cutoff": number(3.0 * units.length),
        "spring": f"{number(0.5 * units.stiffness)} {number(units.length)}",
    }


def _plain(name: str) -> str:
    """Replace characters of a file name that are not safe in a comment."""
    return "".join(c if c in SAFE_PATH_CHARACTERS else "?" for c in name[:60])


def _plan_values(
    problem: Problem, plan: ScriptPlan, steps: ScriptedSteps | None, units: UnitSystem
) -> dict[str, Any]:
    """Return the template values of time step, its bounds, largest velocity and error."""
    multiples = (1.0,) if plan.bar is None else plan.bar.multiples
    longest = max(multiples) if steps is None else steps.heaviest * max(multiples)
    limit = 0.5 * VERLET_STABILITY_LIMIT / problem.fast_stiffness**0.5
    return {
        "scripted": True,
        "composed": steps is not None,
        "particles": problem.particles,
        # This text has all digits; an equal-style variable would have 15.
        "timestep": "${step}",
        "step": number(units.time * plan.numerics.timestep),
        "shortest": number(units.time * SHORTEST_TIMESTEP / problem.fast_stiffness**0.5),
        "unstable": number(units.time * limit / longest),
        "fastest": number(units.speed * (plan.fastest or problem.impact_velocity)),
        "multiples": multiples,
        "bar": plan.bar,
        "tolerance": None if plan.tolerance is None else number(plan.tolerance),
        "doubt": None if plan.doubt is None else textwrap.wrap(plan.doubt, 90),
        "scene_sha256": plan.scene_sha256,
    }


def _end_values(
    scouted: ExpectedEnd | None, times: EndTimes, values: dict[str, Any], time: float
) -> dict[str, Any]:
    """Return the template values of the end; at another velocity, the script detects the end."""
    last = number(time * (0.0 if scouted is None else scouted.last_contact_time))
    own = "" if values["given_velocities"] else f"*(v_velocity=={values['velocity']})"
    return asdict(times) | {
        "moment_of_time": number(1e-9 * time),
        "scouted": scouted,
        "scouted_time": last,
        "scouted_until": last if scouted is None else last + own,
        "now": "v_now" if values["approaches"] else "time",
    }


def _wished_values(wishes: JobWishes) -> dict[str, Any]:
    """Return the template values of optional features and of their files."""
    interval = wishes.frame_interval
    frames = "contacts" if interval is None else number(wishes.units.time * interval)
    return {
        "frame_time": frames if wishes.dump else None,
        "restartable": wishes.restartable,
        "guards": wishes.guards,
        "misspelt": _MISSPELT,
        "contacts_listed": wishes.contacts,
        "dump_file": DUMP_FILE,
        "log_file": LOG_FILE,
        "contacts_file": CONTACTS_FILE,
        "restart_file": RESTART_FILE,
        "state_file": STATE_FILE,
        "other_forces": wishes.template is not None and wishes.template.other_forces,
        "reports": wishes.template is not None and wishes.template.reports,
    }


def _kept(values: dict[str, Any]) -> dict[str, list[str]]:
    """Return the names of variables that a script must save to continue from a contact."""
    results = ["restitution", "counted", "ended"]
    running = ["contacts", "last"]
    if values["guards"]:
        results += ["changed", "pushed"]
        running += ["impulse"]
    if values["approaches"]:
        running += ["begun"]
    if values["soft"]:
        running += ["touched"]
    return {
        "kept_choices": ["timestep"] if values["given_velocities"] else ["velocity", "timestep"],
        "kept_results": results,
        "kept": [*(["apart", *results] if values["bar"] else []), *running],
    }
