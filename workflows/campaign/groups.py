"""Group those scenes of `collide_many` that differ only in seed and speed."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import whole_number_given
from chaincor.lammps_inputs.scene import FILE_KEYS, Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import seed_of
from chaincor.lammps_inputs.scene_parts.identity import plain_fields
from chaincor.lammps_inputs.thermal_state import LARGEST_SEED, draw
from chaincor.workflows.accuracy.plan import plan
from chaincor.workflows.engines.reference.batch.chains import StartStates
from chaincor.workflows.given import scenes_given

MOST_SAMPLES = 10_000_000
# Fields in which the samples of one ensemble may differ.
_VARYING = ("seed", "velocity", "speed")


@dataclass(frozen=True)
class Group(Sequence[Scene]):
    """Scenes that differ only in seed and impact velocity, created on request."""

    scene: Scene  #: First scene.
    seeds: Sequence[int | None]  #: Seed of each scene.
    velocities: Array  #: Impact velocity of each scene, of shape (scenes,).
    places: Sequence[int]  #: Indices among all requested scenes.
    given: Sequence[Scene] | None = None  #: The scenes, if they have already been created.

    def __len__(self) -> int:
        return len(self.seeds)

    def __getitem__(self, k: Any) -> Any:
        """Return one scene, or a group with the scenes of a slice."""
        if isinstance(k, slice):
            given = None if self.given is None else self.given[k]
            return Group(self.scene, self.seeds[k], self.velocities[k], self.places[k], given)
        if self.given is not None:
            return self.given[k]
        velocity = float(self.velocities[k])
        if velocity == self.scene.impact_velocity:
            return self.scene.replace(seed=self.seeds[k])
        return self.scene.without("speed").replace(seed=self.seeds[k], velocity=velocity)

    @cached_property
    def expected(self) -> float:
        """Expected time of one scene, in seconds."""
        return plan(self.scene).seconds

    def starts(self) -> StartStates:
        """Return the initial states, drawn with the same random numbers as for single scenes."""
        scene, line = self.scene, self.scene.line
        assert scene.temperature is not None
        seeds = [seed for seed in self.seeds if seed is not None]
        drawn = draw(scene.bond, scene.temperature, line.chain_masses, np.zeros(0), seeds)
        return StartStates(
            np.concatenate((drawn.gaps[:, None], drawn.strains), axis=1),
            drawn.velocities - self.velocities[:, None],
        )


def group_scenes(
    scenes: Scene | Sequence[Scene], samples: int | None, velocities: ArrayLike | None
) -> list[Group]:
    """
    Divide the requested scenes into groups that can each run in one batch.

    Raise InputError for invalid requests, and if there is no scene.
    """
    if isinstance(scenes, Scene):
        return [_drawn_group(scenes, samples, velocities)]
    for name, value in (("samples", samples), ("velocities", velocities)):
        if value is not None:
            raise InputError(
                f"{name} needs one scene, for which seeds are drawn. Give one scene "
                f"instead of a list, or omit {name}"
            )
    chosen = scenes_given(scenes)
    if not chosen:
        raise InputError("no scenes were given. Give at least one")
    found: dict[Any, list[int]] = {}
    for place, scene in enumerate(chosen):
        _refuse_outputs(scene)
        found.setdefault(_key(scene), []).append(place)
    groups = []
    for places in found.values():
        given = tuple(chosen[place] for place in places)
        seeds = [None if scene.temperature is None else seed_of(scene) for scene in given]
        velocities = np.array([scene.impact_velocity for scene in given])
        groups.append(Group(given[0], seeds, velocities, places, given))
    return groups


def _drawn_group(scene: Scene, samples: int | None, velocities: ArrayLike | None) -> Group:
    samples = whole_number_given("samples", samples, most=MOST_SAMPLES)
    if scene.temperature is None:
        raise InputError(
            "samples needs a temperature, because a cold chain always collides in the same way. "
            "Give temperature, such as 1e-3, or leave samples out"
        )
    _refuse_outputs(scene)
    first = seed_of(scene)
    if first + samples - 1 > LARGEST_SEED:
        raise InputError(
            f"the seeds of {samples} samples from {first} on exceed the largest seed, "
            f"{LARGEST_SEED}. Give a smaller seed"
        )
    seeds = range(first, first + samples)
    each = np.full(samples, scene.impact_velocity)
    if velocities is not None:
        each = np.array(velocities, dtype=float)
        if each.shape != (samples,) or not np.all(np.isfinite(each) & (each > 0.0)):
            raise InputError(
                f"velocities of the shape {each.shape} are no {samples} positive numbers. Give "
                f"{samples} finite numbers above 0"
            )
        # If any velocity is invalid, the smallest or the largest velocity is invalid, too.
        for velocity in {float(np.min(each)), float(np.max(each))}:
            scene.without("speed").replace(velocity=velocity)
    return Group(scene, seeds, each, range(samples))


def _refuse_outputs(scene: Scene) -> None:
    for key in FILE_KEYS:
        if getattr(scene, key) is not None and key in scene.model_fields_set:
            raise InputError(
                f"{key} is given, but every sample would write to it. Leave it out, and run the "
                "collision of one seed to keep its motion"
            )


def _key(scene: Scene) -> Any:
    """
    Return the key that is equal in all scenes of a group.

    A user's own potential counts as equal only to itself.
    """
    fields = {k: v for k, v in plain_fields(scene).items() if k not in _VARYING}
    potential = fields.pop("potential", None)
    same = id(potential) if isinstance(potential, Potential) else potential
    return same, json.dumps(fields, sort_keys=True)


def shared_fields(groups: Sequence[Group]) -> dict[str, Any]:
    """Return the fields that are equal in all scenes."""
    first, *others = (plain_fields(group.scene) for group in groups)
    shared = {k: v for k, v in first.items() if all(other.get(k) == v for other in others)}
    if groups[0].given is not None:
        shared = {k: v for k, v in shared.items() if k not in _VARYING}
    if isinstance(shared.get("potential"), Potential):
        shared["potential"] = groups[0].scene.label
    return shared
