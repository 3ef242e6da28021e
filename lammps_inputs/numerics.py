"""The numerics of one run: who reflects, how a step is composed, how the bond is tabulated."""

from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle, Wall
from chaincor.lammps_inputs.schemes import DEFAULT_TIMESTEPS, Scheme, StepSchemeName

DEFAULT_REFLECT_TIMESTEP = 0.005


@dataclass(frozen=True)
class Numerics:
    """Settings that decide the accuracy and the cost of one run."""

    wall: Wall = "event"  #: ``event`` (impact-located) or ``reflect`` (the stock LAMMPS fix).
    #: ``verlet``, ``order4``, ``order6`` or ``order8``; with the event wall also ``extrapolated12``
    #: and so on, in-house ``srkn14``, see ``chaincor.workflows.engines.schemes``.
    scheme: StepSchemeName = "order6"
    timestep: float = DEFAULT_TIMESTEPS["order6"]  #: The composed step H.
    table: TableStyle = "spline"  #: ``linear`` or ``spline``.
    #: Rows of the bond table; None lets the range of the scene decide.
    table_points: int | None = None
    #: Shortest and longest bond the table must hold; None lets the engine find it.
    bond_range: tuple[float, float] | None = None
    #: Force error the rows are chosen for, where `table_points` is None; None: as small as a table
    #: of reasonable length can have.
    force_error: float | None = None

    @classmethod
    def from_scene(cls, scene: Scene) -> "Numerics":
        """Complete the numerics a scene gives with the defaults of their kind."""
        wall = scene.wall or "event"
        scheme: Scheme = scene.scheme or ("verlet" if wall == "reflect" else "order6")
        usual = DEFAULT_REFLECT_TIMESTEP if wall == "reflect" else DEFAULT_TIMESTEPS[scheme]
        return cls(
            wall=wall,
            scheme=scheme,
            timestep=scene.timestep or usual,
            # A spline cannot hold a kink.
            table=scene.table or ("linear" if scene.bond.kinks else "spline"),
            table_points=scene.table_points,
        )
