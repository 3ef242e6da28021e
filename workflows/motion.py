"""The motion of a collision, for pictures: frames at regular times, by the in-house engines."""

from lammps_inputs.potentials import Harmonic
from lammps_inputs.scene import Scene
from workflows.engines import modal, stiff
from workflows.engines.outcome import Outcome

# Far finer than any picture resolves.
_ACCURACY = 1e-6


def record_motion(scene: Scene, interval: float) -> Outcome:
    """
    Carry a chain through its collision and keep frames of the motion.

    Parameters
    ----------
    scene : Scene
        What collides; its engine and numerics are not used.
    interval : float
        Time between frames.

    Returns
    -------
    Outcome
        With ``frames``, from the first contact to the end of the run.

    Raises
    ------
    RunError
        If the motion cannot be followed; each cause has a name.
    """
    if isinstance(scene.bond, Harmonic):
        return modal.run(scene, interval)
    return stiff.run(scene, _ACCURACY, interval)


def write_animation(scene: Scene, last_contact_time: float, path: str, pictures: int = 60) -> None:
    """
    Draw a collision as a moving picture.

    Parameters
    ----------
    scene : Scene
        What collides.
    last_contact_time : float
        Time of its last contact; the picture ends soon after.
    path : str
        ``.gif``, or ``.mp4`` with ffmpeg.
    pictures : int
        How many pictures it is made of, 25 a second.

    Raises
    ------
    InputError
        If the file's name ends otherwise.
    """
    from analysis.figures.animation import animate_collision

    # Two units of time are sound crossing two bonds: enough to see the chain fly off.
    end = 1.15 * last_contact_time + 2.0
    frames = record_motion(scene, end / 400.0).frames
    assert frames is not None
    shown = frames.times <= end
    animate_collision(
        frames.times[shown],
        frames.displacements[shown],
        frames.velocities[shown],
        path,
        impact_velocity=scene.impact_velocity,
        frames=pictures,
        title=f"{scene.particles} particles, {scene.label} bonds, v0 = {scene.impact_velocity:.4g}",
    )
