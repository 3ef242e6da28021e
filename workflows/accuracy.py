"""Tolerance in, numerics and error bar out."""

from lammps_inputs.scene import Scene
from workflows.accuracy_in_house import meet_in_house
from workflows.accuracy_lammps import meet_with_lammps
from workflows.answer import Answer


def meet(scene: Scene, tolerance: float) -> Answer:
    """
    Run a scene with the cheapest numerics that meet a tolerance, and prove that they do.

    Parameters
    ----------
    scene : Scene
        The collision, without explicit numerics.
    tolerance : float
        Absolute error asked of eta.

    Returns
    -------
    Answer
        With the reason where the tolerance could not be met.
    """
    if scene.engine == "lammps":
        return meet_with_lammps(scene, tolerance)
    return meet_in_house(scene, tolerance)
