"""Recompute the motion behind a result on request."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.history import Record
from chaincor.analysis.observables import Observed
from chaincor.analysis.results import History
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import whole_number_given
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import SensitivityError

if TYPE_CHECKING:
    from ase import Atoms
    from MDAnalysis import Universe

    from chaincor.workflows.engines.replay import Replay
    from chaincor.workflows.sensitivity.sensitivity import Sensitivity

# Runs with these schemes have no fixed steps.
_WITHOUT_STEPS = ("hard-sphere", "adaptive8")
# If rounding errors change eta by more than this, they decide which contacts occur, and derivatives
# are refused. Below this limit, rounding errors are amplified by less than 1e12.
_HINGES = 1e-4
# Pictures show the flight after the collision for _FLY_ON times the duration of the collision plus
# the time in which sound crosses _BONDS_ON bonds.
_FLY_ON, _BONDS_ON = 0.15, 2.0
# A picture shows at most _HISTORY_FRAMES states; their memory is limited to _HISTORY_BYTES.
_HISTORY_FRAMES = 400
_MOST_FRAMES = 1_000_000
_HISTORY_BYTES = 64 * 2**20


@dataclass(frozen=True, repr=False, kw_only=True)
class ResultMotion(Observed):
    """Observables and motion of a run."""

    #: Settings for repeating the run; None in a result that `collide` did not make.
    replay: "Replay | None" = field(default=None, compare=False)

    @property
    def scene(self) -> Scene:
        """Scene of the result; raises InputError if `collide` did not make the result."""
        return self._known_replay().scene

    @property
    def shown_until(self) -> float:
        """Time at which pictures end, while the chain flies away."""
        flown = _BONDS_ON / self.scene.problem.slow_stiffness**0.5
        end = (1.0 + _FLY_ON) * self.last_contact_time + flown
        # Soft bodies overlap during a contact; pictures last at least until the bodies have parted.
        return end if self.contact is None else max(end, self.duration)

    @cached_property
    def history(self) -> History:
        """
        States of the chain from the first contact until shortly after the last contact.

        The history contains states and energies at about 400 times, or at fewer times for long
        chains. When the history is first used, the engine of the result repeats the collision.
        Raises the errors of :meth:`trajectory`.
        """
        return self._histories[0]

    @property
    def target_history(self) -> History | None:
        """States of a free target, counted from the contact outward; None for a wall."""
        return self._histories[1] if self._known_replay().scene.target_particles else None

    @cached_property
    def _histories(self) -> tuple[History, History | None]:
        replay = self._known_replay()
        scene, masses = replay.scene, replay.masses
        room = _HISTORY_BYTES // (16 * scene.problem.all_particles)
        states = self.trajectory(max(2, min(_HISTORY_FRAMES, room)))
        n = scene.particles
        records = [Record(m, scene.bond) for m in (masses[:n], masses[n:]) if m.size]
        for state in states:
            for record, body in zip(records, state.bodies, strict=True):
                record.feed(body)
        chain, *target = (record.history(0.0) for record in records)
        return chain, target[0].mirrored if target else None

    @cached_property
    def sensitivity(self) -> "Sensitivity":
        """
        Derivatives of eta with respect to speed, masses, bonds and initial state.

        They come from one additional run. Raises SensitivityError if eta has no derivative, or if
        no digit of the derivative is certain.
        """
        from chaincor.workflows.sensitivity.sensitivity import sensitivity_of

        scene = self._known_replay().scene
        if self.ending == "open" or self.restitution_error is None:
            raise SensitivityError(
                f"this collision has the ending {self.ending} and the error bar "
                f"{self.restitution_error}. Choose a collision that is over and has an "
                "error bar"
            )
        if scene.bond.only_pushes:
            raise SensitivityError(
                f"derivatives need fixed steps, but steps for {scene.label} beads adapt "
                "to the overlaps. Run nearby scenes and take differences"
            )
        if self.scheme in _WITHOUT_STEPS or scene.particles == 1:
            raise SensitivityError(
                f"a collision of {scene.particles} particles by scheme '{self.scheme}' cannot "
                "be differentiated. Lower the speed, so that fixed steps follow the bonds"
            )
        if self.error_parts.rounding > _HINGES:
            raise SensitivityError(
                f"roundings change eta by up to {self.error_parts.rounding:.2g}, so "
                "they decide which contacts occur, and derivatives are meaningless. "
                "Take fewer particles or a lower speed"
            )
        shortest = self.bond_min - scene.bond.natural_length
        known = self.restitution, self.restitution_error
        return sensitivity_of(scene, self.contacts, self.duration, shortest, *known)

    def _known_replay(self) -> "Replay":
        if self.replay is None:
            raise InputError(
                "this result does not contain the run that made it. Use a result of collide()"
            )
        return self.replay

    def trajectory(self, frames: int = 200) -> list[ChainState]:
        """
        Repeat the collision with the same numerics, and return the motion.

        Parameters
        ----------
        frames : int
            Approximate number of states; LAMMPS records states only at the ends of steps.

        Returns
        -------
        list of ChainState
            States from the first contact (time 0) until shortly after the last contact. The
            intervals between states are equal; with LAMMPS they are nearly equal. With the
            stock wall, the first state is one step after the contact. The `step` of a state is
            its index.

        Raises
        ------
        InputError
            If `frames` is not a whole number from 2 to a million, or if `collide` did not make the
            result.
        RunError
            If the result is the limit of hard spheres, which has no motion to show.
        """
        frames = whole_number_given("frames", frames, least=2, most=_MOST_FRAMES)
        replay = self._known_replay()
        end = self.shown_until
        recorded = replay.record(end / (frames - 1))
        # Because of rounding, the last time may be slightly larger than `end`.
        return [
            recorded.state(step)
            for step, time in enumerate(recorded.times)
            if time <= end * (1.0 + 1e-9)
        ]

    def to_ase(self, frames: int = 200) -> "list[Atoms]":
        """
        Repeat the collision, and return the motion as a list of ASE Atoms, one per frame.

        All quantities are in the reduced units of this package, not in eV, angstrom and ASE's time
        unit.

        Parameters
        ----------
        frames : int
            As for :meth:`trajectory`.

        Returns
        -------
        list of ase.Atoms
            Atoms with float64 positions (x, 0, 0), velocities, masses, an array ``bonds``,
            ``info["time"]``, potential energy and bond forces. There is no cell, and the wall at x
            = 0 is not included. Particles of a free target follow the particles of the chain.

        Raises
        ------
        InputError, RunError
            As :meth:`trajectory`.
        """
        from chaincor.analysis.dumps.other_formats import ase_atoms

        states = self.trajectory(frames)
        replay = self._known_replay()
        masses, bond = replay.masses, replay.scene.bond
        return [ase_atoms(state, masses, bond) for state in states]

    def to_universe(self, frames: int = 200) -> "Universe":
        """
        Repeat the collision, and return the motion as an MDAnalysis Universe.

        All quantities are in the reduced units of this package, not in angstrom, picoseconds and
        daltons.

        Parameters
        ----------
        frames : int
            As for :meth:`trajectory`.

        Returns
        -------
        MDAnalysis.Universe
            Universe with times, masses, ids, bonds between neighbours, and no box. Ids count
            through the chain from the contact outward, then through a free target. MDAnalysis
            stores positions and velocities as float32. The float64 values are in ``ts.data`` as
            ``v_displacement`` (u_i, see :class:`~chaincor.analysis.dumps.chain_state.ChainState`)
            and ``vx``.

        Raises
        ------
        InputError, RunError
            As :meth:`trajectory`.
        """
        from chaincor.analysis.dumps.universe import universe_of_states

        states = self.trajectory(frames)
        return universe_of_states(states, self._known_replay().masses)
