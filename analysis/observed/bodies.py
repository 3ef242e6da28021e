"""Observables of the bodies that collide."""

from dataclasses import dataclass, make_dataclass
from typing import TYPE_CHECKING, Any

from chaincor.analysis.observed.observable import TextRow, observable
from chaincor.analysis.observed.of_dumps import of_target
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_KEYS, CONTACT_PARAMETERS


def _given(name: str) -> Any:
    """Return a function that reads a given property of the bodies from the scene."""
    return lambda record: record.bodies_given.get(name)


def _in_units(velocity: float, v_star: float | None) -> float | None:
    return None if v_star is None else velocity / v_star


@dataclass(frozen=True, repr=False, kw_only=True)
class _BodiesAndContact:
    """Observables of the bodies, up to and including the name of the contact law."""

    potential: str = observable(
        "name of the bond",
        shared=True,
        run=lambda r: r.scene.label,
        dump=lambda a: None if a.bond is None else a.bond.name,
    )
    particles: int = observable(
        "number of particles in the chain",
        shared=True,
        run=lambda r: r.scene.particles,
        dump=lambda a: a.particles,
        axis=r"number of particles $n$",
    )
    velocity: float = observable(
        "impact speed of the chain's centre of mass; relative to a free target",
        unit="speed",
        symbol="v0",
        run=lambda r: r.scene.impact_velocity,
        dump=lambda a: a.velocity,
        axis=r"impact speed $v_0$",
    )
    speed: float | None = observable(
        "impact speed in units of v*; null for harmonic bonds, which have no v*",
        TextRow("v*", also=("v_star",), words=("v_star", "speed", "u", "v0")),
        run=lambda r: _in_units(r.scene.impact_velocity, r.scene.bond.natural_speed),
        dump=lambda a: _in_units(a.velocity, None if a.bond is None else a.bond.natural_speed),
        axis=r"impact speed $v_0/v^*$",
    )
    v_star: float | None = observable(
        "speed at which a bond no longer acts as a spring: the kinetic energy of one particle "
        "with this speed compresses the bond until it stores twice the energy of an equally "
        "stiff spring of the same length",
        unit="speed",
        symbol="v*",
        shared=True,
        run=lambda r: r.scene.bond.natural_speed,
        dump=lambda a: None if a.bond is None else a.bond.natural_speed,
    )
    masses: tuple[float, ...] | None = observable(
        "masses of the chain's particles from the contact outward, repeated along the chain",
        unit="mass",
        shape="(m,)",
        rare=True,
        shared=True,
        run=_given("masses"),
        dump=lambda a: a.masses,
    )
    target_particles: int | None = observable(
        "number of particles of a free target; null for a wall",
        rare=True,
        shared=True,
        run=_given("target_particles"),
        dump=lambda a: a.target_particles,
    )
    target_masses: tuple[float, ...] | None = observable(
        "masses of the target's particles from the contact outward, repeated along the target",
        unit="mass",
        shape="(m,)",
        rare=True,
        shared=True,
        run=_given("target_masses"),
        dump=of_target("masses", ()),
    )
    contact: str | None = observable(
        "name of the contact law of soft bodies", rare=True, shared=True, run=_given("contact")
    )


def _contact_parameter(key: str) -> tuple[str, Any, Any]:
    """Return a parameter of contact laws as a field, with the description of its key."""
    definition = CONTACT_PARAMETERS[key].description.partition(" [")[0]
    return key, float | None, observable(definition, rare=True, shared=True, run=_given(key))


if TYPE_CHECKING:
    _WithContact = _BodiesAndContact
else:
    _WithContact = make_dataclass(
        "_WithContact",
        map(_contact_parameter, CONTACT_KEYS),
        bases=(_BodiesAndContact,),
        frozen=True,
        repr=False,
        kw_only=True,
    )


@dataclass(frozen=True, repr=False, kw_only=True)
class Bodies(_WithContact):
    """Observables of the bodies that collide."""

    initial: str | None = observable(
        "file that gives the initial state of the chain",
        rare=True,
        shared=True,
        run=_given("initial"),
    )
    compression: float | None = observable(
        "fraction by which all bonds of the chain are compressed at the start",
        rare=True,
        shared=True,
        run=_given("compression"),
    )
    temperature: float | None = observable(
        "k_B T of both bodies at the start",
        unit="energy",
        rare=True,
        shared=True,
        run=_given("temperature"),
    )
    seed: int | None = observable(
        "seed of the random initial state", rare=True, shared=True, run=_given("seed")
    )
    energy: str | None = observable(
        "formula of the bond energy",
        rare=True,
        shared=True,
        run=lambda r: None if r.formula() is None else r.formula().text,
    )
    parameters: dict[str, float] | None = observable(
        "values of the parameters in the formula",
        rare=True,
        shared=True,
        run=lambda r: None if r.formula() is None else dict(r.formula().given),
    )
    stiffness: float | None = observable(
        "stiffness U'' of a bond at its natural length, unless it is 1",
        rare=True,
        shared=True,
        run=lambda r: r.unless_one("stiffness"),
    )
    natural_length: float | None = observable(
        "natural length of a bond, unless it is 1",
        unit="length",
        rare=True,
        shared=True,
        run=lambda r: r.unless_one("natural_length"),
    )
