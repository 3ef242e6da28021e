"""Rules that the fields of a scene must satisfy together."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.equilibrium import bond_distribution
from chaincor.lammps_inputs.bonds.potentials import BOND_KEYS, missing_keys
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_KEYS, CONTACT_LAWS, laws_with
from chaincor.lammps_inputs.errors import ChaincorError, SceneError, meant
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.lammps_inputs.scene_parts.bead_rules import check_beads
from chaincor.lammps_inputs.scene_parts.scene_fields import BODY_KEYS, NUMERICS_KEYS

if TYPE_CHECKING:
    from pydantic import ValidationError

    from chaincor.lammps_inputs.scene import Scene

# Verlet is unstable from omega dt = 2, with the fastest chain mode omega = 2 sqrt(U''(1)).
VERLET_STABILITY_LIMIT = 2.0

LARGEST_MASS_RATIO = 1e12
# With larger masses, energies can overflow.
LARGEST_MASS = 1e30

# Smallest impact velocity of warm bodies, in units of sqrt(T). Warm bodies start tens of bond
# lengths apart, and slower bodies would take too long to touch.
SLOWEST_APPROACH = 1e-4

# The stiffness of contacts must lie between 1/LARGEST_STIFFNESS and LARGEST_STIFFNESS, because
# times would otherwise overflow.
LARGEST_STIFFNESS = 1e100
# With shorter steps, even the smallest collision would take days, and rounding would dominate.
SHORTEST_TIMESTEP = 1e-9


# Keys of files for other commands, and the message about such a file.
_SWEEP_FILE = "this is the file of a sweep. Give the file of a scene, or run `chaincor sweep FILE`"
_OTHER_FILES = {
    "scene": _SWEEP_FILE,
    "axes": _SWEEP_FILE,
    "units": (
        "units belong to LAMMPS jobs. Remove them from the scene, or run `chaincor inputs FILE`"
    ),
}

# Largest number of mistakes in a message.
_MOST_MISTAKES = 20


def scene_error(error: "ValidationError", known: Iterable[str]) -> SceneError:
    """Return the first mistakes in a scene, one per line; `known` are all keys of scenes."""
    lines: dict[Any, str] = {}
    for problem in error.errors():
        if len(lines) == _MOST_MISTAKES:
            break
        # pydantic reports two problems for a field with two possible types. The first is
        # sufficient.
        key = problem["loc"][0] if problem["loc"] else problem["msg"]
        lines.setdefault(key, _one_line(problem, tuple(known)))
    return SceneError.of(list(lines.values()))


def _one_line(problem: Any, known: Sequence[str]) -> str:
    message = problem["msg"].removeprefix("Value error, ")
    if problem["type"] == "extra_forbidden":
        key = str(problem["loc"][0])
        if key in _OTHER_FILES:
            return f"unknown key '{key}': {_OTHER_FILES[key]}"
        near = meant(key, known)
        if near is not None:
            return f"unknown key '{key}'; did you mean '{near}'?"
        return f"unknown key '{key}'. Use one of {', '.join(known)}"
    if not problem["loc"]:
        return message
    given = problem.get("input")
    if isinstance(given, Path):  # the end of the message is the most informative part
        given = str(given) if len(str(given)) <= 58 else f"...{str(given)[-55:]}"
    said = shown(given, 61)
    said = said if len(said) <= 60 else said[:57] + "..."
    return f"{problem['loc'][0]} is {said}: {message[0].lower() + message[1:]}"


def check_together(scene: "Scene") -> None:
    """
    Refuse fields that are valid separately but not in combination.

    Raises SceneError with one line for each mistake.
    """
    mistakes: dict[str, None] = {}
    checks = (
        *(_check_parameters, _check_bodies, _check_speed, _check_warmth),
        *(check_beads, _check_numerics),
    )
    # Masses may overflow before they are refused.
    with np.errstate(all="ignore"):
        for check in checks:
            try:
                for mistake in check(scene):
                    mistakes[mistake] = None
            except (ChaincorError, ValueError, TypeError, LookupError):
                if not mistakes:
                    raise
                # If there was an earlier mistake, an error in a check is only its consequence.
    if mistakes:
        raise SceneError.of(list(mistakes))


def _check_parameters(scene: "Scene") -> Iterator[str]:
    given = scene.bond_fields
    for key in given:
        if scene.potential != BOND_KEYS[key]:
            yield (f"{key} goes with potential '{BOND_KEYS[key]}', not '{scene.label}'")
    if isinstance(scene.potential, str) and (missing := missing_keys(scene.potential, given)):
        yield (f"potential '{scene.potential}' needs {missing}")
    _ = scene.bond  # this raises an error if the bond has impossible parameters


def _check_bodies(scene: "Scene") -> Iterator[str]:
    if scene.masses is not None and len(scene.masses) > scene.particles:
        yield (
            f"masses has {len(scene.masses)} numbers. Give at most {scene.particles}, one "
            "for each particle"
        )
    if scene.target_masses is not None:
        if scene.target_particles is None:
            yield ("target_masses has no effect without target_particles. Give both")
        elif len(scene.target_masses) > scene.target_particles:
            yield (
                f"target_masses has {len(scene.target_masses)} numbers. Give at most "
                f"{scene.target_particles}, one for each particle of the target"
            )
    for key in CONTACT_KEYS:
        laws = laws_with(key)
        if getattr(scene, key) is not None and scene.contact not in laws:
            yield (f"{key} goes with contact {' or '.join(map(repr, laws))}")
    if scene.contact is not None and (key := CONTACT_LAWS[scene.contact].strength_key):
        stiffness = getattr(scene, key) or 1.0
        if not 1.0 / LARGEST_STIFFNESS <= stiffness <= LARGEST_STIFFNESS:
            yield (
                f"{key} is {stiffness:g}. Give a number from {1.0 / LARGEST_STIFFNESS:g} to "
                f"{LARGEST_STIFFNESS:g}"
            )
    state = scene.initial_state
    if state is not None:
        if len(state.strains) + 1 != scene.particles:
            yield (
                f"initial has {len(state.strains) + 1} particles, but the chain has "
                f"{scene.particles}. Give one row for each particle"
            )
        if scene.compression is not None:
            yield ("initial and compression are both given. Give one")
        if state.masses is not None and scene.masses is not None:
            yield ("masses are given twice, in initial and in masses. Drop one")
        strained = _is_impossible(scene, state.strains)
        if np.any(strained):
            bond = int(np.argmax(strained))
            yield (
                f"initial has a bond of length {1.0 + state.strains[bond]:g} between particles "
                f"{bond + 1} and {bond + 2}, where a {scene.label} bond is not defined or does not "
                "hold"
            )
    if scene.compression is not None and _is_impossible(scene, np.array([-scene.compression]))[0]:
        yield (
            f"compression is {scene.compression:g}: a {scene.label} bond of length "
            f"{1.0 - scene.compression:g} is not defined or does not hold"
        )
    yield from _check_masses(scene)


def _is_impossible(scene: "Scene", strains: Array) -> NDArray[np.bool_]:
    bond = scene.bond
    longest = min(bond.strain_max, bond.barrier_strain)
    return (strains <= bond.strain_min) | (strains >= longest)


def _check_masses(scene: "Scene") -> Iterator[str]:
    state = scene.initial_state
    given = [scene.masses, scene.target_masses, None if state is None else state.masses]
    if all(masses is None for masses in given):
        return
    # Masses that are not given are 1.
    if given[0] is None and given[2] is None:
        given.append((1.0,))
    if given[1] is None and scene.target_particles is not None:
        given.append((1.0,))
    bounds = [(np.min(masses), np.max(masses)) for masses in given if masses is not None]
    least, largest = min(low for low, _ in bounds), max(high for _, high in bounds)
    if largest / LARGEST_MASS_RATIO > least:
        yield (
            f"masses are {least:g} to {largest:g}. Give masses with a ratio of at most "
            f"{LARGEST_MASS_RATIO:g}; a larger ratio loses all digits"
        )
    if not (largest <= LARGEST_MASS and least >= 1.0 / LARGEST_MASS):
        yield (
            f"masses are {least:g} to {largest:g}. Give masses from {1.0 / LARGEST_MASS:g} "
            f"to {LARGEST_MASS:g}: divide all masses by one of them, which changes only the "
            "unit"
        )


def _check_speed(scene: "Scene") -> Iterator[str]:
    if scene.speed is not None and scene.velocity is not None:
        yield ("speed and velocity are both given. Give one")
    state = scene.initial_state
    if state is not None and state.velocities is not None:
        for key in ("speed", "velocity"):
            if getattr(scene, key) is not None:
                yield (f"{key} and the velocities in initial are both given. Drop one")
        if not scene.impact_velocity > 0.0:
            yield (
                f"the centre of mass of initial moves with velocity {-scene.impact_velocity:g}. "
                "Give velocities that move it towards the target (below 0)"
            )
            return
    if scene.speed is not None and scene.bond.natural_speed is None:
        yield (
            f"speed is in units of v*, which the {scene.label} bond does not have; give velocity"
        )
    velocity = scene.impact_velocity
    # The bodies are constructed only if they matter, because this takes most of the time.
    usual = scene.model_fields_set.isdisjoint(BODY_KEYS) and scene.bond.contact is None
    largest = 1e150 if usual or scene.line.is_standard else 1e120
    if not 1.0 / largest < velocity < largest:
        yield (
            f"the impact velocity would be {velocity:g}. Give a number whose "
            "square does not overflow"
        )


def _check_warmth(scene: "Scene") -> Iterator[str]:
    if scene.temperature is None:
        if scene.seed is not None:
            yield ("seed has no effect without temperature. Give temperature, or drop seed")
        return
    for key in ("initial", "compression"):
        if getattr(scene, key) is not None:
            yield (f"temperature and {key} both define the initial state. Drop one")
    # this raises an error if there is no equilibrium
    bond_distribution(scene.bond, scene.temperature)
    slowest = SLOWEST_APPROACH * scene.temperature**0.5
    if not slowest < scene.impact_velocity:
        yield (
            f"temperature is {scene.temperature:g} and the impact velocity "
            f"{scene.impact_velocity:g}, less than {SLOWEST_APPROACH:g} of the thermal "
            f"velocity, so the approach would take too long. Give more than {slowest:g}"
        )


def _check_numerics(scene: "Scene") -> Iterator[str]:
    given = [key for key in NUMERICS_KEYS if getattr(scene, key) is not None]
    if not scene.error and not given:
        yield (
            "error is False, but choosing the numerics needs an error bar. Leave error "
            "out, or give explicit numerics, such as scheme and timestep"
        )
    if scene.bond.is_harmonic:
        for key in ("table", "table_points"):
            if getattr(scene, key) is not None:
                yield (
                    f"{key} is for bond tables, but LAMMPS has harmonic bonds without a table. "
                    f"Drop {key}"
                )
    if scene.tolerance is not None and given:
        yield (
            f"tolerance and {', '.join(given)} are both given; a tolerance chooses the numerics "
            "by itself. Drop one or the other"
        )
    if scene.engine == "reference":
        for key in ("table", "table_points", "save", "dump"):
            if getattr(scene, key) is not None:
                yield (
                    f"{key} is for engine 'lammps', because the reference has no tables, jobs "
                    f"or dumps. Drop {key}"
                )
        if scene.wall == "reflect":
            yield ("wall 'reflect' is for engine 'lammps'. Use wall 'event' with the reference")
    soft = scene.contact is not None and CONTACT_LAWS[scene.contact].soft
    if scene.wall == "reflect" and (scene.target_particles is not None or soft):
        yield ("wall 'reflect' is a rigid, hard wall. Leave the target out and use contact 'hard'")
    if scene.wall == "reflect" and scene.scheme not in (None, "verlet"):
        yield (
            f"wall 'reflect' goes with scheme 'verlet', not '{scene.scheme}'. Change one of them"
        )
    if scene.timestep is not None:
        stiffness = scene.problem.fast_stiffness
        shortest = SHORTEST_TIMESTEP / stiffness**0.5
        if scene.timestep < shortest:
            yield (
                f"timestep is {scene.timestep:g}. Give {shortest:g} or more: a shorter step "
                "would take too long"
            )
        limit = VERLET_STABILITY_LIMIT / (2.0 * stiffness**0.5)
        if scene.timestep >= limit:
            yield (
                f"timestep is {scene.timestep:g}. Give less than {limit:g}: at this step the "
                "chain's fastest mode becomes unstable"
            )
