"""Run one collision through LAMMPS's Python module."""

import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from chaincor.analysis.atomic_write import folder_aside, written_aside
from chaincor.lammps_inputs.bond_table import BondTable, tabulate_near_and_far
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.run_files import NO_FILES, RunFiles
from chaincor.lammps_inputs.script import DATA_FILE, DUMP_FILE
from chaincor.workflows.engines.end_watch import longest_collision
from chaincor.workflows.engines.lammps.beads import run_beads
from chaincor.workflows.engines.lammps.certificate import certify_table
from chaincor.workflows.engines.lammps.flight import flight_of
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.lammps.kept_script import kept_files
from chaincor.workflows.engines.lammps.lammps_collision import ChainCollision
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH, Outcome
from chaincor.workflows.engines.rounding import rounding_error
from chaincor.workflows.errors import (
    BondRangeError,
    ChaincorError,
    CrossingError,
    LostAtomsError,
    TimestepError,
    ToleranceError,
)
from chaincor.workflows.measured import measured
from chaincor.workflows.outputs import sign_job

# First guess of the range of bond lengths: the most compressed bond has the energy _GUESS_ENERGY
# v0^2, and the longest bond has the strain _GUESS_STRETCH v0. Two particles that collide at the
# relative velocity 2 v0 compress their bond with the energy v0^2, or somewhat more if other
# particles push. Bonds stretch about as fast as they were compressed. The engine widens a range
# that is too narrow, by _WIDENING; the guess therefore affects only the cost.
_GUESS_ENERGY = 1.6
_GUESS_STRETCH = 3.0
_WIDENING = 1.5
_MOST_WIDENINGS = 12
# Folder for those files of a saved job that its script needs, but the engine does not.
_KEPT = "kept"
# Bond lengths are examined only at intervals. The largest stretch may therefore exceed the largest
# observed stretch by this fraction.
_UNSEEN: float = measured("unseen_stretch")
# A run is refused if the rounding error of eta would exceed this value.
_LARGEST_FLOOR = 0.1


def run(
    problem: Problem,
    numerics: Numerics,
    frame_interval: float | None = None,
    files: RunFiles = NO_FILES,
) -> Outcome:
    """
    Run one collision in LAMMPS.

    Frames are taken at the ends of steps, at least `frame_interval` apart. Without a
    `frame_interval` there are no frames. Raises a RunError that names the failure: a bond outside
    its table, particles that would cross, a bond over its barrier, a collision that does not end,
    or an error of LAMMPS.
    """
    (outcome,) = run_at_steps(problem, numerics, (numerics.timestep,), frame_interval, files)
    return outcome


def run_at_steps(
    problem: Problem,
    numerics: Numerics,
    timesteps: Sequence[float],
    frame_interval: float | None = None,
    files: RunFiles = NO_FILES,
) -> tuple[Outcome, ...]:
    """
    Run one collision several times, at different time steps, in one LAMMPS instance.

    The chain, its bond table and the certificate are prepared once; for fast chains, this
    preparation takes most of the time. Only the first run has a dump and frames. Each outcome
    equals the outcome of a separate run to the last bit. Raises the same errors as :func:`run`.
    """
    floor = rounding_error("lammps", problem)
    if floor > _LARGEST_FLOOR:
        raise ToleranceError(
            f"at velocity {problem.impact_velocity:g} the motion of {problem.particles} "
            "particles is lost in the rounding of LAMMPS's absolute coordinates: eta would "
            f"be wrong by {floor:.1g}. Use engine 'reference', which has no such limit, or "
            "a faster chain"
        )
    if problem.bond.only_pushes:
        return run_beads(problem, numerics, timesteps, frame_interval)
    with tempfile.TemporaryDirectory(prefix="chaincor-") as name:
        folder = Path(name)
        try:
            outcomes = _run_in_folder(problem, numerics, timesteps, frame_interval, folder, files)
        except ChaincorError:
            # Keep the files of a failed run for inspection, but never overwrite a finished job.
            if files.save is not None and not (files.save / DATA_FILE).exists():
                _keep_job(files.save, folder)
            raise
        if files.save is not None:
            _keep_job(files.save, folder, files.dump)
        if files.dump is not None:
            with written_aside(files.dump, "dump") as aside:
                shutil.move(folder / DUMP_FILE, aside)
        return outcomes


def _keep_job(target: Path, folder: Path, dump: Path | None = None) -> None:
    # If the user's dump lies in this folder under its own name, the folder gets no second copy.
    named = dump is not None and dump.parent.resolve() == target.resolve()
    files = [
        file
        for file in sorted(folder.iterdir())
        if file.is_file() and not (named and file.name == DUMP_FILE)
    ]
    with folder_aside(target) as aside:
        # The files of the script are copied last. They replace files that only the engine can use.
        for file in [*files, *folder.glob(f"{_KEPT}/*")]:
            shutil.copy2(file, aside / file.name)
        sign_job(aside)


def _write_kept(
    problem: Problem,
    numerics: Numerics,
    table: BondTable | None,
    outcome: Outcome | None,
    folder: Path,
    files: RunFiles,
) -> None:
    if files.save is None:
        return
    (folder / _KEPT).mkdir(exist_ok=True)
    for name, text in kept_files(problem, numerics, table, outcome, files.scene).items():
        (folder / _KEPT / name).write_text(text)


@dataclass(frozen=True)
class _Runs:
    """Results of all runs with the same bond table."""

    #: Outcomes of the time steps whose runs reached the end of the collision.
    outcomes: list[Outcome]
    longest_seen: float  #: Length of the longest bond at any time in these runs.
    stopped: BondRangeError | LostAtomsError | None  #: Error that stopped the next run.


def _run_in_folder(
    problem: Problem,
    numerics: Numerics,
    timesteps: Sequence[float],
    frame_interval: float | None,
    folder: Path,
    files: RunFiles,
) -> tuple[Outcome, ...]:
    bond = problem.bond

    def collide_all(table: BondTable | None) -> _Runs:
        return _collide(problem, numerics, timesteps, table, frame_interval, folder, files)

    if bond.is_harmonic or problem.longest_body == 1:
        runs = collide_all(None)
        if runs.stopped is not None:
            raise runs.stopped
        return tuple(runs.outcomes)
    bond_range = numerics.bond_range or guess_bond_range(problem)
    excused = False
    for _ in range(_MOST_WIDENINGS):
        table = tabulate_near_and_far(
            bond, bond_range, numerics.table, numerics.table_points, numerics.force_error
        )
        runs = collide_all(table)
        error, seen = runs.stopped, runs.longest_seen
        held = seen < table.longest - _unsure_end(table, numerics)
        if error is not None:
            if isinstance(error, BondRangeError) and np.isnan(error.length):
                # a wider table is impossible, because the potential has no data beyond this one
                raise error
            length = error.length if isinstance(error, BondRangeError) else np.inf
            if _is_impossible(problem, length):
                # If a bond is less than one bin longer than the last row, LAMMPS reads undefined
                # memory and the bond may get any length. One such failure is tolerated.
                if excused:
                    raise TimestepError(
                        f"{error}. The energy of this chain allows no such bond. "
                        "Use a smaller timestep"
                    )
                excused, length = True, table.longest
            if runs.outcomes and held and numerics.bond_range is not None:
                # The first run is complete, and later runs with longer steps only check it. A bond
                # left the table in a later run. The remaining runs get a separate table, which is
                # wider and less accurate.
                wider = replace(numerics, bond_range=_widened(bond, table, length))
                left = timesteps[len(runs.outcomes) :]
                return (*runs.outcomes, *run_at_steps(problem, wider, left))
        elif held:
            return tuple(runs.outcomes)
        else:
            length = max(seen, table.longest)
        bond_range = _widened(bond, table, length)
    raise BondRangeError(
        f"bonds still leave a table from {bond_range[0]:g} to {bond_range[1]:g}. Use a "
        "smaller timestep, or engine 'reference'"
    )


def guess_bond_range(problem: Problem) -> tuple[float, float]:
    """Return a guess of the shortest and longest bond length in a collision."""
    bond, v0, line = problem.bond, problem.impact_velocity, problem.line
    heaviest = max(1.0, float(np.max(line.chain_masses)))
    shortest = bond.compressed_strain(_GUESS_ENERGY * heaviest * v0**2)
    longest = min(_GUESS_STRETCH * heaviest**0.5 * v0, 0.9 * bond.strain_max)
    strains = np.delete(line.strains, line.gap)
    shortest = min(shortest, float(np.min(strains, initial=0.0)))
    longest = max(longest, float(np.max(strains, initial=0.0)))
    return 1.0 + shortest, 1.0 + longest


def _unsure_end(table: BondTable, numerics: Numerics) -> float:
    """Return the margin at the end of a table; bonds in this margin may have left it unseen."""
    if numerics.bond_range is None:
        return _UNSEEN * (table.longest - 1.0)
    return (table.far or table).spacing


def _is_impossible(problem: Problem, length: float) -> bool:
    """Return whether a bond of this length needs more energy than the chain had at impact."""
    energy = problem.start_energy
    # A bond cannot exceed the length that it reaches if its two particles have all the energy and
    # separate during the whole collision. Nor can the energy of one bond exceed the total energy,
    # except by an error of the integration.
    speed = 2.0 * (energy / problem.line.lightest) ** 0.5
    longest = 1.0 + speed * longest_collision(problem.longest_body, problem.slow_stiffness, np.inf)
    if length > longest:
        return True
    return float(problem.bond.energy(np.array(length - 1.0))) > MOST_ENERGY_GROWTH * energy


def _widened(bond: Potential, table: BondTable, length: float) -> tuple[float, float]:
    low, high = float(table.lengths[0]), table.longest
    if length >= high:
        if length - 1.0 >= bond.strain_max:
            raise BondRangeError(
                f"a bond of length {length:g} is beyond the potential's own data, which end at "
                f"{1.0 + bond.strain_max:g}. Extend the bond table"
            )
        high = 1.0 + _WIDENING * max(length - 1.0, 2.0 * (high - 1.0))
        high = min(high, 1.0 + bond.strain_max)
    elif length > 1.0:
        raise TimestepError(
            f"a very long bond contracted to {length:g} within one step. Use a smaller timestep"
        )
    else:
        floor = max(1.0 + bond.strain_min, 0.0)
        # A small compression is multiplied by _WIDENING. If the compression is large, the remaining
        # length above `floor` is divided by _WIDENING instead.
        low = max(
            1.0 - _WIDENING * max(1.0 - length, 2.0 * (1.0 - low)),
            floor + (max(length, floor) - floor) / _WIDENING,
        )
        if low - floor < 1e-3:
            raise CrossingError(
                f"a bond was compressed to {length:g} of its natural length. Lower the speed or "
                "the timestep, or use engine 'reference'"
            )
    return low, high


def _collide(
    problem: Problem,
    numerics: Numerics,
    timesteps: Sequence[float],
    table: BondTable | None,
    frame_interval: float | None,
    folder: Path,
    files: RunFiles,
) -> _Runs:
    """Run the collision at each time step until a bond leaves the table."""
    outcomes: list[Outcome] = []
    longest_seen, stopped, dumping = 0.0, None, files
    numerics_first = replace(numerics, timestep=timesteps[0])
    _write_kept(problem, numerics_first, table, None, folder, files)
    with LammpsChain(problem, numerics, table, folder, log=files.save is not None) as chain:
        details = {}
        if table is not None:
            details["table"] = asdict(certify_table(chain, table, problem.bond))
        for timestep in timesteps:
            chain.restart(timestep)
            used = replace(numerics, timestep=timestep)
            collision = ChainCollision(
                problem, flight_of(chain, problem, used), frame_interval, dumping
            )
            started = time.perf_counter()
            try:
                collision.carry_out()
            except (BondRangeError, LostAtomsError) as error:
                stopped = error
                break
            seconds = time.perf_counter() - started
            outcome = collision.outcome(used, seconds)
            outcomes.append(replace(outcome, numerics=used, details=details))
            longest_seen = max(longest_seen, collision.longest_ever)
            dumping, frame_interval = NO_FILES, None
    if outcomes:
        _write_kept(problem, numerics_first, table, outcomes[0], folder, files)
    return _Runs(outcomes, longest_seen, stopped)
