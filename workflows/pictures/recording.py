"""Record the motion in a collision with the reference engine, for pictures."""

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.step_guess import guess_step
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import adaptive, modal, stepping

if TYPE_CHECKING:
    from chaincor.workflows.result import Collision

# An error as small as this is invisible in a picture.
_ACCURACY = 1e-6
_SCHEME: Final = "order8"


def record_motion(scene: Scene, interval: float) -> Outcome:
    """
    Compute a collision and return frames of the motion.

    The frames are `interval` apart in time, extend from the first contact to the end of the run,
    and include a free target. The reference engine chooses the numerics, and the numerics of the
    scene are ignored.
    """
    if modal.supports(scene.problem):
        return modal.run(scene.problem, interval)
    if not (scene.line.is_standard or scene.bond.only_pushes):
        step = guess_step(scene.problem, _SCHEME, _ACCURACY)
        return stepping.run(scene.problem, Numerics(scheme=_SCHEME, timestep=step), interval)
    return adaptive.run(scene.problem, _ACCURACY, interval)


def follow_to_the_end(result: "Collision") -> Outcome:
    """Return about 400 frames of a collision. The last frames show the departing chain."""
    end = result.shown_until
    outcome = record_motion(result.scene, end / 400.0)
    frames = outcome.frames
    assert frames is not None
    return replace(outcome, frames=frames.until(end))


def write_animation(result: "Collision", path: str, pictures: int = 60) -> None:
    """
    Write an animation of a collision that ends shortly after the last contact.

    The file is a ``.gif``, or with ffmpeg an ``.mp4``. It shows `pictures` frames, 25 per second.
    Raise InputError for another suffix.
    """
    from chaincor.analysis.figures.animation import animate_collision

    scene, frames = result.scene, follow_to_the_end(result).frames
    assert frames is not None
    animate_collision(
        frames.times,
        *frames.along_x(),
        path,
        targets=frames.targets,
        impact_velocity=scene.impact_velocity,
        frames=pictures,
        title=f"{scene.particles} particles, {scene.label} bonds, v0 = {scene.impact_velocity:.4g}",
    )
