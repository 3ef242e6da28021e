"""The motion behind a result: carried out again where it is asked for."""

from typing import TYPE_CHECKING

from chaincor.analysis.dumps.chain_frames import ChainState
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.replay import Replay

if TYPE_CHECKING:
    from ase import Atoms
    from MDAnalysis import Universe

# A trajectory ends when the chain has left the wall for this share of the collision, and for as
# long as sound takes over two bonds.
_FLY_ON = (0.15, 2.0)


class Motion:
    """What a result can show of the motion, from how it was run and how long it took."""

    replay: Replay | None
    last_contact_time: float
    contact: str | None
    duration: float

    def trajectory(self, frames: int = 200) -> list[ChainState]:
        """
        Carry the collision out again, as this result was, and keep the motion.

        Parameters
        ----------
        frames : int
            How many states to keep, about: LAMMPS has them at the ends of steps only.

        Returns
        -------
        list of ChainState
            From the first contact (time 0) until soon after the last, at even intervals or, by
            LAMMPS, nearly so; with the stock wall one step later. `step` counts them.

        Raises
        ------
        InputError
            If fewer than two frames are asked for, or the result was not made by `collide`.
        RunError
            If the result is the limit of hard spheres, which has no motion to show.
        """
        if frames < 2:
            raise InputError(f"{frames} frames are asked for; expected 2 or more")
        if self.replay is None:
            raise InputError(
                "the result does not say how it was run; expected one returned by collide()"
            )
        share, flight = _FLY_ON
        end = (1.0 + share) * self.last_contact_time + flight
        if self.contact is not None:  # the bodies overlap for a while
            end = max(end, self.duration)
        recorded = self.replay.record(end / (frames - 1))
        # The last may be late by rounding.
        return [
            recorded.state(step)
            for step, time in enumerate(recorded.times)
            if time <= end * (1.0 + 1e-9)
        ]

    def to_ase(self, frames: int = 200) -> "list[Atoms]":
        """
        Return the motion as ASE Atoms; the collision is carried out again for it.

        Numbers are the reduced ones of this package, not eV, angstrom and ASE's time.

        Parameters
        ----------
        frames : int
            As for :meth:`trajectory`.

        Returns
        -------
        list of ase.Atoms
            Float64 positions (x, 0, 0), velocities, masses, array ``bonds``, ``info["time"]``;
            each knows its potential energy and the forces of the bonds. No cell: the wall at x = 0
            is no part of the Atoms. A free target's particles follow those of the chain.

        Raises
        ------
        InputError, RunError
            As :meth:`trajectory`.
        """
        from chaincor.analysis.dumps.other_formats import ase_atoms

        states = self.trajectory(frames)
        assert self.replay is not None
        masses, bond = self.replay.masses, self.replay.scene.bond
        return [ase_atoms(state, masses, bond) for state in states]

    def to_universe(self, frames: int = 200) -> "Universe":
        """
        Return the motion as an MDAnalysis Universe; the collision is carried out again for it.

        Numbers are the reduced ones of this package, not angstrom, picoseconds and daltons.

        Parameters
        ----------
        frames : int
            As for :meth:`trajectory`.

        Returns
        -------
        MDAnalysis.Universe
            With times, masses, ids from the wall outwards (of a free target after the chain's, from
            the contact outward), bonds between neighbours, no box. MDAnalysis keeps positions and
            velocities as float32; float64 ones are in ``ts.data`` as ``v_displacement`` (u_i, see
            :class:`~chaincor.analysis.dumps.chain_frames.ChainState`) and ``vx``.

        Raises
        ------
        InputError, RunError
            As :meth:`trajectory`.
        """
        from chaincor.analysis.dumps.universe import universe_of_states

        states = self.trajectory(frames)
        assert self.replay is not None
        return universe_of_states(states, self.replay.masses)
