"""Compare LAMMPS with the reference engine, and judge differences by their error bars."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from chaincor.analysis.error_bar import error_alone
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.granular import ROWS, TABLE_ERROR, bead_table_rows
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, NUMERICS_KEYS, OUTPUT_KEYS, Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import given_bodies
from chaincor.workflows.accuracy.bounded_run import farthest
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.reference import hard_sphere
from chaincor.workflows.given import scene_given
from chaincor.workflows.json_output import finite
from chaincor.workflows.result import Collision

# Smallest assumed step, as a multiple of 1/omega of the fastest bond. Bond lengths are recorded at
# the ends of steps. Between these, lengths can exceed the recorded extremes slightly.
_USUAL_STEP = 0.4
_ROUNDING = 1e-12

# The tolerance of the reference run is the requested tolerance times this factor, so that the error
# of the reference run does not limit the comparison.
SHARPER = 0.1
SHARPEST = 1e-11


@dataclass(frozen=True)
class Comparison:
    """Comparison of one quantity between two integrators."""

    quantity: str  #: Name of the quantity.
    #: Largest absolute difference, in the unit of the quantity; inf if the numbers of contacts
    #: differ.
    difference: float
    allowed: float | None  #: Sum of both error bars; None if the quantity is not judged.

    @property
    def agrees(self) -> bool:
        """Whether the difference is at most the sum of the error bars."""
        return self.allowed is None or bool(self.difference <= self.allowed)

    def to_dict(self) -> dict[str, Any]:
        """Return the fields and the verdict for JSON; an infinite difference becomes None."""
        return finite(asdict(self) | {"agrees": self.agrees})


# In a headline, a value has at most this many characters.
_LONGEST = 30


@dataclass(frozen=True, repr=False)
class Validation:
    """
    Comparison of a collision between two integrators.

    Attributes
    ----------
    scene : Scene
        The collision.
    subject, judge : str
        Names of the judged integrator and of the integrator that judges it.
    restitution, judge_restitution : float
        Values of eta from both integrators.
    comparisons : tuple of Comparison
        Comparisons of eta and other quantities.
    note : str or None
        Known reason for a difference.
    """

    scene: Scene
    subject: str
    judge: str
    restitution: float
    judge_restitution: float
    comparisons: tuple[Comparison, ...]
    note: str | None = None

    @classmethod
    def of(
        cls,
        scene: Scene,
        subject: str,
        restitution: float,
        error: float,
        judge: Collision,
        others: Iterable[Comparison],
    ) -> Self:
        """Return a validation from two restitutions and comparisons of other quantities."""
        difference = abs(restitution - judge.restitution)
        allowed = error + (judge.restitution_error or 0.0)
        comparisons = (Comparison("restitution", difference, allowed), *others)
        return cls(scene, subject, "reference", restitution, judge.restitution, comparisons)

    @property
    def agrees(self) -> bool:
        """Whether all quantities agree."""
        return all(comparison.agrees for comparison in self.comparisons)

    def __repr__(self) -> str:
        scene = self.scene
        lines = [
            f"{scene.particles} particles, {scene.label} bonds, v0 = {scene.impact_velocity:.6g}"
            + "".join(f", {key} {_short(value)}" for key, value in given_bodies(scene).items()),
            f"judged:  {self.subject}, eta = {self.restitution:.12g}",
            f"by:      {self.judge}, eta = {self.judge_restitution:.12g}",
            f"{'quantity':16} {'difference':>12} {'error bars':>12}",
        ]
        for comparison in self.comparisons:
            allowed = "not judged" if comparison.allowed is None else f"{comparison.allowed:.1e}"
            verdict = (
                "" if comparison.allowed is None else "agrees" if comparison.agrees else "DIFFERS"
            )
            lines.append(
                f"{comparison.quantity:16} {comparison.difference:12.1e} {allowed:>12}  {verdict}"
            )
        lines.append(f"verdict: {'they agree' if self.agrees else 'they DIFFER'}")
        lines += [] if self.note is None else [f"note: {self.note}"]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return all results as plain values for JSON."""
        return {
            "potential": self.scene.label,
            "particles": self.scene.particles,
            "velocity": self.scene.impact_velocity,
            **given_bodies(self.scene),
            "scene": self.scene.canonical_fields,
            "subject": self.subject,
            "judge": self.judge,
            "restitution": self.restitution,
            "judge_restitution": self.judge_restitution,
            "agrees": self.agrees,
            **({} if self.note is None else {"note": self.note}),
            "comparisons": [comparison.to_dict() for comparison in self.comparisons],
        }


def _short(value: Any) -> str:
    text = ", ".join(f"{item:g}" for item in value) if isinstance(value, tuple) else str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def judge_for(scene: Scene, tolerance: float) -> Collision:
    """Run the reference engine with a smaller tolerance than that of the judged result."""
    return collide(judging_scene(scene.without(*OUTPUT_KEYS), SHARPER * tolerance))


def judging_scene(scene: Scene, tolerance: float) -> Scene:
    """Return the scene for the reference engine, with a tolerance that this engine can meet."""
    fields = dict.fromkeys(NUMERICS_KEYS)
    return scene.replace(engine="reference", tolerance=max(tolerance, SHARPEST), **fields)


def validate(scene: Scene, tolerance: float | None = None) -> Validation:
    """
    Compare LAMMPS with the reference engine.

    Parameters
    ----------
    scene : Scene
        The collision. If the scene has explicit numerics, LAMMPS uses them.
    tolerance : float, optional
        Tolerance for LAMMPS's eta; by default the scene's tolerance, or 1e-6.

    Returns
    -------
    Validation
        The comparison.

    Examples
    --------
    >>> from chaincor import Scene, validate
    >>> validation = validate(Scene(particles=5))
    >>> validation.agrees, validation.comparisons[1].quantity
    (True, 'contacts')
    """
    scene = scene_given(scene)
    asked = tolerance or scene.tolerance or DEFAULT_TOLERANCE
    if not scene.error:
        raise InputError("error is False, but the comparison needs error bars. Leave out error")
    subject = collide(scene.replace(engine="lammps"), None if scene.explicit else asked)
    judge = judge_for(scene, asked)
    comparisons = [
        compare_contacts(subject.contacts, judge, subject),
        Comparison("fragments", abs(subject.fragments - judge.fragments), 0.0),
    ]
    for name in ("bond_min", "bond_max"):
        lengths = getattr(subject, name), getattr(judge, name)
        strain = max(abs(length - scene.bond.natural_length) for length in lengths)
        allowed: float | None = _unseen_share(scene, subject, judge) * strain + _ROUNDING
        if name == "bond_max" and hard_sphere.SCHEME in (subject.scheme, judge.scheme):
            allowed = None  # Hard spheres have no largest bond length.
        if subject.contacts != judge.contacts:
            allowed = None  # The ranges are not compared, because they end at different contacts.
        comparisons.append(Comparison(name, abs(lengths[0] - lengths[1]), allowed))
    names = ["contact_times", "contact_speeds", "velocities", "mode_energies"]
    if scene.target_particles is not None:
        names += ["target_velocities", "target_mode_energies"]
    names = [name for name in names if getattr(judge, name) is not None]
    hinges = any(map(_hinges_on_contacts, (subject, judge)))
    for name in names:
        allowed = math.inf if hinges else _spread(subject, name) + _spread(judge, name)
        distance = farthest(getattr(subject, name), getattr(judge, name))
        comparisons.append(Comparison(name, distance, allowed if np.isfinite(allowed) else None))
    if scene.bond.only_pushes:
        comparisons += _by_force_table(scene, subject, judge)
    name = f"LAMMPS, {subject.wall} wall, {subject.scheme}, H = {subject.timestep:.4g}"
    error = error_alone(subject.details, subject.restitution_error or 0.0)
    return Validation.of(scene, name, subject.restitution, error, judge, comparisons)


def _by_force_table(scene: Scene, subject: Collision, judge: Collision) -> Iterator[Comparison]:
    """
    Yield the comparison of a run with tabulated forces with the reference engine.

    Beads of a power law have a table in LAMMPS besides its granular styles. At the step of the
    granular run it may err as much as this run.
    """
    rows = bead_table_rows(scene.problem, Numerics(table_points=scene.table_points))
    if rows is not None or scene.damping is not None or scene.diameters is not None:
        return  # the run has used a table, or a table cannot describe the beads
    fields = dict.fromkeys(NUMERICS_KEYS) | {"timestep": subject.timestep, "table_points": ROWS}
    by_table = collide(scene.replace(engine="lammps", tolerance=None, error=False, **fields))
    bars = [result.restitution_error for result in (subject, judge)]
    allowed = None if None in bars else sum(bars) + TABLE_ERROR  # type: ignore[arg-type]
    distance = abs(by_table.restitution - judge.restitution)
    yield Comparison("table_restitution", distance, allowed)


def compare_contacts(count: int, judge: Collision, *subjects: Collision) -> Comparison:
    """
    Compare the numbers of contacts, which must be equal.

    The numbers are not judged in two cases: if the end of the collision is open, because the error
    bar of the restitution then covers a late contact, or if the runs behind one result differ in
    their numbers of contacts.
    """
    results = (judge, *subjects)
    judged = all(r.ending != "open" and not _hinges_on_contacts(r) for r in results)
    return Comparison("contacts", abs(count - judge.contacts), 0.0 if judged else None)


def _unseen_share(scene: Scene, *results: Collision) -> float:
    """
    Return by which fraction a strain between steps can exceed the strains at their ends.

    The highest frequency of the chain is twice the frequency of a bond with the lightest mass.
    Between two times that are H apart, an extreme therefore exceeds both values by at most the
    fraction 1 - cos(H).
    """
    steps = [
        r.timestep * scene.problem.fast_stiffness**0.5 for r in results if r.timestep is not None
    ]
    return 1.0 - math.cos(min(max([_USUAL_STEP, *steps]), math.pi))


def _hinges_on_contacts(result: Collision) -> bool:
    """Return whether agreement would be chance because a result's own runs differ in contacts."""
    return math.isinf(result.details.get("spread", {}).get("contact_times", 0.0))


def _spread(result: Collision, name: str) -> float:
    return float(result.details.get("spread", {}).get(name, np.inf))
