"""
Running things: engines, accuracy, sweeps and the command line.

The two names most scripts need are here, imported at first use:
:class:`~lammps_inputs.scene.Scene` and :func:`~workflows.collision.collide`.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lammps_inputs.scene import Scene
    from workflows.collision import collide

__all__ = ["Scene", "collide"]


def __getattr__(name: str) -> Any:
    if name == "Scene":
        from lammps_inputs.scene import Scene

        return Scene
    if name == "collide":
        from workflows.collision import collide

        return collide
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
