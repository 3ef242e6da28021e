"""Rendering the LAMMPS input: every value is a number or a fixed name, never a user's text."""

from dataclasses import asdict, dataclass
from functools import cache
from pathlib import PurePosixPath
from typing import Any, Literal

from chaincor.lammps_inputs.bond_table import KEYWORDS, BondTable
from chaincor.lammps_inputs.contact_script import contact_values, number
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.rules import SHORTEST_TIMESTEP, VERLET_STABILITY_LIMIT
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


@dataclass(frozen=True)
class ScoutedEnd:
    """
    How a collision ended that a script runs again.

    Attributes
    ----------
    last_contact_time : float
        From the first contact.
    contacts : int
        Hits on the wall.
    ending : str
        ``proved``, ``argued`` or ``open``.
    """

    last_contact_time: float
    contacts: int
    ending: str


@dataclass(frozen=True)
class ScriptedSteps:
    """
    How a script composes its steps.

    Attributes
    ----------
    weights : tuple of float
        w_k of the Verlet steps w_k H, a palindrome.
    order : int
        Order of the error of one run against H.
    citation : str
        Where the weights are from.
    coarse : float
        Verlet step in which a silence is waited for.
    patience : float
        Time after a contact from which on a silence is waited for so.
    graded : tuple of float or None
        Time near the touching and parting of soft bodies in which steps are graded, and the power
        of that; None where they are not.
    """

    weights: tuple[float, ...]
    order: int
    citation: str
    coarse: float
    patience: float
    graded: tuple[float, float] | None = None


@dataclass(frozen=True)
class ScriptedBar:
    """
    What a script needs to tell the error of its number.

    Attributes
    ----------
    multiples : tuple of float
        Steps of the runs in units of the number's own; the first is 1.
    share : float
        Error of the number due to its step, over the largest difference to the other runs.
    share_alone : float
        The same where nothing but these runs is known.
    table, rounding, ending : float
        Parts of the error that are known beforehand.
    reference_solution, reference_error : float or None
        Restitution of an in-house run, and its error; None where there was none.
    least : float
        What the error due to the step is called at least.
    """

    multiples: tuple[float, ...]
    share: float
    share_alone: float
    table: float
    rounding: float
    ending: float
    reference_solution: float | None = None
    reference_error: float = 0.0
    least: float = 0.0

    def numbers(self) -> dict[str, Any]:
        """Return the fields as text for a script."""
        fields = {k: v for k, v in asdict(self).items() if k != "multiples"}
        return {k: None if v is None else number(v) for k, v in fields.items()}


@dataclass(frozen=True)
class Extras:
    """
    What a script does besides telling its number; each adds a block.

    Attributes
    ----------
    restartable : bool
        It writes restart files and goes on from them.
    guards : bool
        It refuses by name what it is not made for, and holds the momentum of the chain against what
        its contacts gave.
    contacts : bool
        It lists its contacts in a file.
    frame_time : float or "contacts" or None
        Time between frames of a dump, or one after each contact; None for no dump.
    """

    restartable: bool = False
    guards: bool = False
    contacts: bool = False
    frame_time: float | Literal["contacts"] | None = None


NO_EXTRAS = Extras()

# What users of LAMMPS give by -var where a script knows velocity and timestep.
_MISSPELT = ("speed", "v0", "vel", "velo", "v", "dt", "h", "step", "time_step", "timesteps")


@cache
def _environment() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("chaincor.lammps_inputs", "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # the text is no HTML, and nothing in it comes from a user
    )


def _setup_values(numerics: Numerics, table: BondTable | None, folder: str) -> dict[str, Any]:
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


def render_setup(numerics: Numerics, table: BondTable | None, folder: str) -> str:
    """
    Render the commands that set a chain up for a run driven from Python.

    `folder`, of the program's own making, is where the data file and the table lie; SceneError if
    its name has characters that LAMMPS would interpret.
    """
    if not set(folder) <= _SAFE_PATH_CHARACTERS:
        raise SceneError(
            f"the temporary folder is {folder!r}; expected a path of letters, digits and ./_+-: "
            "set TMPDIR to such a folder"
        )
    template = _environment().get_template("setup.in.j2")
    return template.render(_setup_values(numerics, table, folder))


def render_plain_template(
    scene: Scene,
    table: BondTable | None,
    units: UnitSystem,
    template: OwnTemplate | None = None,
    **values: Any,
) -> str:
    """
    Render the plain script with these values and those that all scripts of a scene share.

    A `template` that is a whole script takes its place.
    """
    shared = _setup_values(Numerics.from_scene(scene), table, ".") | _in_units(scene, units)
    given = scene.temperature is not None or scene.initial is not None
    values |= {"given_velocities": given}
    if template is None:
        return str(_environment().get_template("plain.in.j2").render(shared | values))
    values |= {
        "particles": scene.particles,
        "timestep": values["step"],
        "wall": "fix wall all wall/reflect xlo 0.0",
        "bond_coeff": shared["spring"] if table is None else f"{TABLE_FILE} {KEYWORDS[0]}",
    }
    if table is not None:
        values["bond_table"] = TABLE_FILE
    return template.render_whole(shared | values)


def _in_units(scene: Scene, units: UnitSystem) -> dict[str, Any]:
    """Return what a script says of a scene, in its units."""
    targets = scene.target_particles
    return {
        "title": f"A chain of {scene.particles} particles with {_plain(scene.bond.name)} bonds "
        + ("meets a wall" if targets is None else f"meets {targets} at rest"),
        "velocity": number(units.speed * scene.impact_velocity),
        "units": units.style,
        "reduced": units == CHAIN_UNITS,
        "cutoff": number(3.0 * units.length),
        "spring": f"{number(0.5 * units.stiffness)} {number(units.length)}",
    }


def _plain(name: str) -> str:
    """Return a name fit for a comment: that of a bond table's file may hold anything."""
    return "".join(c if c in _SAFE_PATH_CHARACTERS else "?" for c in name[:60])


_SAFE_PATH_CHARACTERS = frozenset(
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789./_+-"
)


def render_job(
    scene: Scene,
    numerics: Numerics,
    table: BondTable | None,
    *,
    quiet: float,
    cap: float,
    look: float,
    scouted: ScoutedEnd | None,
    extras: Extras = NO_EXTRAS,
    steps: ScriptedSteps | None = None,
    bar: ScriptedBar | None = None,
    tolerance: float | None = None,
    fastest: float | None = None,
    template: OwnTemplate | None = None,
    units: UnitSystem = CHAIN_UNITS,
) -> str:
    """
    Render a self-contained input script for ``lmp -in``.

    Parameters
    ----------
    scene : Scene
        The collision.
    numerics : Numerics
        Wall, scheme and timestep.
    table : BondTable or None
        The bond table; None for LAMMPS's own harmonic bond.
    quiet : float
        Time without a contact after which the collision is over.
    cap : float
        Simulated time at which an unfinished collision is given up.
    look : float
        Time between two looks for the end.
    scouted : ScoutedEnd or None
        How the same collision ended elsewhere: the script does not end before; None where that is
        not known.
    extras : Extras
        What the script does besides.
    steps : ScriptedSteps or None
        How steps are composed; None for Verlet steps.
    bar : ScriptedBar or None
        How the script tells its error, which takes further runs; None for the number alone.
    tolerance : float or None
        What the numerics were chosen for, to be said in the heading.
    fastest : float or None
        Largest velocity that is not refused; None for that of the scene.
    template : OwnTemplate or None
        What the user adds.
    units : UnitSystem
        In which LAMMPS computes; all of the above is in those of the chain.

    Returns
    -------
    str
        The script's text.
    """
    composed, frames = steps is not None, extras.frame_time
    heaviest = 1.0 if steps is None else max(map(abs, steps.weights))
    multiples = (1.0,) if bar is None else bar.multiples
    values = _setup_values(numerics, table, str(PurePosixPath(".")))
    values |= contact_values(scene, numerics.wall, units) | _in_units(scene, units)
    time, speed = units.time, units.speed
    limit = 0.5 * VERLET_STABILITY_LIMIT / scene.fast_stiffness**0.5
    values |= {
        "scripted": True,
        # As text, with all its digits: an equal-style variable has 15.
        "timestep": "${step}",
        "step": number(time * numerics.timestep),
        "shortest": number(time * SHORTEST_TIMESTEP / scene.fast_stiffness**0.5),
        "unstable": number(time * limit / (heaviest * max(multiples))),
        "particles": scene.particles,
        "fastest": number(speed * (fastest or scene.impact_velocity)),
        "quiet": number(time * quiet),
        "cap": number(time * cap),
        "look": number(time * look),
        "frame_time": number(time * frames) if isinstance(frames, float) else frames,
        "restartable": extras.restartable,
        "guards": extras.guards,
        "misspelt": _MISSPELT,
        "contacts_listed": extras.contacts,
        "dump_file": DUMP_FILE,
        "log_file": LOG_FILE,
        "contacts_file": CONTACTS_FILE,
        "moment_of_time": number(1e-9 * time),
        "restart_file": RESTART_FILE,
        "state_file": STATE_FILE,
        "composed": composed,
        "multiples": [number(multiple) for multiple in multiples],
        "bar": None if bar is None else bar.numbers(),
        "tolerance": None if tolerance is None else number(tolerance),
        "scouted": scouted,
    }
    last = number(time * (0.0 if scouted is None else scouted.last_contact_time))
    own = "" if values["given_velocities"] else f"*(v_velocity=={values['velocity']})"
    values |= {
        "scouted_time": last,
        "scouted_until": last if scouted is None else last + own,
        "now": "v_now" if values["approaches"] else "time",
    }
    values |= _kept(values)
    if steps is not None:
        values |= {
            "weights": [number(weight) for weight in steps.weights],
            "order": steps.order,
            "citation": steps.citation,
            "coarse": number(time * steps.coarse),
            "patience": number(time * steps.patience),
            "graded": steps.graded is not None,
        }
        if steps.graded is not None:
            zone, power = steps.graded
            values |= {
                "zone": number(time * zone),
                "power": number(power),
                "root_power": number(1.0 / power),
            }
    values["other_forces"] = template is not None and template.other_forces
    values["reports"] = template is not None and template.reports
    text = str(_environment().get_template("job.in.j2").render(values))
    return text if template is None else template.render(values, text)


def _kept(values: dict[str, Any]) -> dict[str, list[str]]:
    """Return the names of what a script must keep to go on from a contact."""
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
