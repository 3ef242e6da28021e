"""Numerics of one run: wall model, scheme, time step and bond table."""

from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle, Wall
from chaincor.lammps_inputs.schemes import COMPOSITIONS, Scheme, StepSchemeName

DEFAULT_REFLECT_TIMESTEP = 0.005


@dataclass(frozen=True)
class Numerics:
    """Settings that determine the accuracy and the cost of one run."""

    #: Wall model: ``event`` (impact-located) or ``reflect`` (the stock LAMMPS fix).
    wall: Wall = "event"
    #: Scheme of ``chaincor.lammps_inputs.schemes``. LAMMPS can take compositions and, with the
    #: event wall, extrapolated steps; its scripts and the stock wall take only compositions.
    scheme: StepSchemeName = "order6"
    timestep: float = COMPOSITIONS["order6"].usual_step  #: Time step H of the scheme.
    table: TableStyle = "spline"  #: Interpolation of the bond table: ``linear`` or ``spline``.
    #: Rows of the bond table; None if they are chosen for the target error.
    table_points: int | None = None
    #: Shortest and longest bond length that the table must cover; None if the engine finds them.
    bond_range: tuple[float, float] | None = None
    #: Target error of the tabulated force, which determines the number of rows if `table_points` is
    #: None. By default it is the smallest error that a table of reasonable length can have.
    force_error: float | None = None

    @classmethod
    def from_scene(cls, scene: Scene) -> "Numerics":
        """Return the numerics of a scene, with default values for missing keys."""
        wall = scene.wall or "event"
        single = wall == "reflect" or scene.bond.only_pushes
        scheme: Scheme = scene.scheme or ("verlet" if single else "order6")
        usual = DEFAULT_REFLECT_TIMESTEP if wall == "reflect" else COMPOSITIONS[scheme].usual_step
        return cls(
            wall=wall,
            scheme=scheme,
            timestep=scene.timestep or usual,
            # A spline cannot represent a kink.
            table=scene.table or ("linear" if scene.bond.kinks else "spline"),
            table_points=scene.table_points,
        )
