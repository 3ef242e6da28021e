"""Control a chain in one LAMMPS instance: its commands, state and steps."""

import ctypes
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bond_table import BondTable
from chaincor.lammps_inputs.chain_data import format_data
from chaincor.lammps_inputs.contact_script import displacement
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.granular import (
    bead_table_rows,
    format_bead_table,
    format_beads,
    render_granular_setup,
)
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.schemes import COMPOSITIONS
from chaincor.lammps_inputs.script import (
    DATA_FILE,
    DUMP_FILE,
    LOG_FILE,
    TABLE_FILE,
    number,
    render_setup,
)
from chaincor.workflows.engines.lammps.far_bonds import FarBonds
from chaincor.workflows.engines.lammps.library import load_lammps, name_lammps_error
from chaincor.workflows.engines.lammps.whole_steps import run_command, whole_step
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.engines.time_limit import check_time, steps_at_once

_RUN_ONE = run_command(1)
# In one LAMMPS step, a particle and its bond take as much time as this number of bond forces in the
# reference engine.
_PARTICLE_WORK = 10


class Snapshot(NamedTuple):
    """State of a chain in LAMMPS."""

    #: Coordinates; of shape (n + M,).
    x: NDArray[np.float64]
    v: NDArray[np.float64]  #: Velocities; of shape (n + M,).
    f: NDArray[np.float64]  #: Forces; of shape (n + M,).
    #: Whether each bond has the far table; None if there is only one table; of shape (bonds,).
    far: NDArray[np.bool_] | None


class LammpsChain:
    """
    Chain in a LAMMPS instance, which must be closed after use.

    The chain starts at its first contact. The arrays `x`, `v` and `f`, of shape (n + M,), are the x
    components of LAMMPS's positions, velocities and forces. They are views of LAMMPS's memory:
    reading costs nothing, and the next step uses values that are written to them. The particles of
    a free target follow the particles of the chain, from the contact outward. Without a table, the
    bonds are harmonic. The files that LAMMPS reads are written to `folder`.
    """

    def __init__(
        self,
        problem: Problem,
        numerics: Numerics,
        table: BondTable | None,
        folder: Path,
        log: bool = False,
    ) -> None:
        self.particles = problem.particles
        count = problem.all_particles
        self._alone = count == problem.particles
        bond_types = 1 if table is None or table.far is None else 2
        beads = problem.bond.only_pushes
        data = format_beads(problem) if beads else format_data(problem.line, bond_types)
        (folder / DATA_FILE).write_text(data)
        if table is not None:
            (folder / TABLE_FILE).write_text(table.to_text())
        if beads and (rows := bead_table_rows(problem, numerics)) is not None:
            (folder / TABLE_FILE).write_text(format_bead_table(problem, rows))
        self.folder = folder
        scheme = STEP_SCHEMES[numerics.scheme]
        self._evaluations = scheme.evaluations
        if not scheme.extrapolated and numerics.scheme not in COMPOSITIONS:
            raise InputError(
                f"scheme is '{numerics.scheme}', which cannot be composed of LAMMPS's Verlet "
                f"steps. Use {', '.join(COMPOSITIONS)} or an extrapolated scheme, or engine "
                "'reference'"
            )
        self.timestep = numerics.timestep
        self.stages_done = 0  #: Number of Verlet steps, equal to the number of force evaluations.
        self._dump_started = False
        self._at_once = steps_at_once(_PARTICLE_WORK * count)
        module = load_lammps()
        log_file = str(folder / LOG_FILE) if log else "none"
        self.lammps: Any = module.lammps(cmdargs=["-log", log_file, "-screen", "none", "-nocite"])
        self._handle = self.lammps.lmp
        # A function that is looked up by its name has no declared argument types. ctypes then
        # converts no arguments, which saves 4 % of the time of a stage.
        self._send = self.lammps.lib["lammps_command"]
        self._send.restype = None
        self._failed = self.lammps.lib.lammps_has_error
        try:
            place = folder.as_posix()
            self.commands(
                render_granular_setup(problem, numerics, place)
                if beads
                else render_setup(numerics, table, place)
            )
        except Exception:
            self.close()
            raise
        ids = self.lammps.numpy.extract_atom("id", nelem=count)
        assert np.array_equal(ids, np.arange(1, count + 1)), "LAMMPS kept the order"
        self.x, self.v, self.f = (
            self.lammps.numpy.extract_atom(name, nelem=count)[:, 0] for name in "xvf"
        )
        #: Assignment of tables to bonds; None if there is only one table.
        self.far_bonds = FarBonds(self) if bond_types > 1 else None
        self._current = numerics.timestep
        self._initial = self.snapshot()
        self._take_step: Callable[[], None] = partial(self._send, self._handle, _RUN_ONE)
        if numerics.scheme != "verlet":  # a single Verlet step needs no loop
            self._take_step = whole_step(self.lammps, scheme, count)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the LAMMPS instance."""
        self.lammps.close()

    def commands(self, text: str) -> None:
        """Execute one command per line; raises RunError with LAMMPS's own message."""
        self.lammps.lib.lammps_commands_string(self._handle, text.encode())
        self._raise_failure()

    def _raise_failure(self) -> None:
        if self._failed(self._handle):
            buffer = ctypes.create_string_buffer(1000)
            self.lammps.lib.lammps_get_last_error_message(self._handle, buffer, 1000)
            raise name_lammps_error(buffer.value.decode(errors="replace"))

    def _set_timestep(self, timestep: float) -> None:
        if timestep != self._current:
            self._send(self._handle, b"timestep " + number(timestep).encode())
            self._current = timestep

    def lengths(self) -> NDArray[np.float64]:
        """Return all bond lengths of the chain, then of the target, from the contact outward."""
        return self.between(self.x)

    def between(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the difference in coordinate or velocity along x between the ends of each bond."""
        n = self.particles
        if self._alone:
            return x[1:] - x[:-1]  # twice as fast as np.diff
        return np.concatenate((x[1:n] - x[: n - 1], x[n:-1] - x[n + 1 :]))

    def run(self, steps: int) -> None:
        """Take full Verlet steps; raises RunError with LAMMPS's own message."""
        self._set_timestep(self.timestep)
        while steps > 0:
            part = steps if self.far_bonds is None else min(steps, self.far_bonds.steps_left())
            for begin in range(0, part, self._at_once):
                taken = min(self._at_once, part - begin)
                check_time()
                self._send(self._handle, run_command(taken))
                self.stages_done += taken
                self._raise_failure()
            steps -= part
            if self.far_bonds is not None:
                self.far_bonds.change_tables()

    def verlet(self, duration: float) -> None:
        """Take one Verlet step of any duration, which may be negative."""
        self._set_timestep(duration)
        self._send(self._handle, _RUN_ONE)
        self.stages_done += 1
        self._raise_failure()

    def step(self, duration: float | None = None) -> None:
        """Take one composed or extrapolated step; by default its length is H."""
        check_time()
        self._set_timestep(self.timestep if duration is None else duration)
        self._take_step()
        self.stages_done += self._evaluations
        self._raise_failure()
        if self.far_bonds is not None:
            self.far_bonds.change_tables()

    def restart(self, timestep: float) -> None:
        """Return the chain to its initial state, to run it with another step H."""
        self.restore(self._initial)
        self.timestep = timestep
        self.stages_done = 0

    def snapshot(self) -> Snapshot:
        """Copy the state, for :meth:`restore`."""
        far = None if self.far_bonds is None else self.far_bonds.far.copy()
        return Snapshot(self.x.copy(), self.v.copy(), self.f.copy(), far)

    def restore(self, state: Snapshot) -> None:
        """Restore a copied state."""
        if self.far_bonds is not None and state.far is not None:
            self.x[:] = state.x
            self.far_bonds.give_tables(state.far)
        self.x[:], self.v[:], self.f[:] = state.x, state.v, state.f

    def write_frame(self, time: float) -> None:
        """Let LAMMPS append a frame to the dump in the folder of the job."""
        if not self._dump_started:
            self.commands(
                "variable clock internal 0.0\n"
                "variable time atom v_clock\n"
                f"variable displacement atom {displacement(self.particles, self._alone)}\n"
            )
        self.lammps.set_internal_variable("clock", time)
        append = "yes" if self._dump_started else "no"
        self.commands(
            f'write_dump all custom "{(self.folder / DUMP_FILE).as_posix()}" '
            f"id type x y z vx vy vz {'' if self._alone else 'mol '}v_displacement v_time "
            f"modify sort id format float %.17g append {append}"
        )
        self._dump_started = True
