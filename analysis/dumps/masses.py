"""Masses of the particles, from the wall outwards: from the dump, the job's files, or given."""

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.data_file import DeclaredMasses
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.modes import are_equal
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError

MASS_COLUMN = "mass"
TYPE_COLUMN = "type"
# Given masses and those of the default format of dumps agree to its six digits.
_SAME_MASS = 1e-5
_NONE_DECLARED = DeclaredMasses()


def masses_of_bodies(
    frame: DumpFrame,
    layout: ChainLayout,
    *,
    given: ArrayLike | None = None,
    declared: DeclaredMasses = _NONE_DECLARED,
) -> tuple[list[Array], bool]:
    """
    Return the masses of the chain, and of a free target, each from the contact outward.

    The column ``mass`` of the dump counts first, then the particles' types with the masses that
    the job declares for them, then those given, which are repeated along a chain and must not
    contradict the others. They are 1 where nothing tells them: the second value says whether
    anything does. Raises InputError if types differ and their masses are not known, if the masses
    given are not those of the job, or if they are given beside a free target.
    """
    if given is not None and layout.targets:
        raise InputError(
            "masses are given, and there is a free target; expected the masses of both bodies in a "
            "column 'mass' of the dump, or in the data file: drop --masses"
        )
    found, why = _by_id(frame, layout.all_particles, declared)
    if given is None:
        if found is None and why:
            raise InputError(
                f"the masses of the particles are not known: {why}; give them from the wall "
                "outwards (--masses 1,2 or --masses FILE), or dump a column 'mass'"
            )
        known = np.ones(layout.all_particles) if found is None else found
        return layout.by_body(known), found is not None
    masses = _repeated(given, layout.particles)
    if found is not None:
        (found,) = layout.by_body(found)
        if not np.allclose(masses, found, rtol=_SAME_MASS, atol=0.0):
            i = int(np.argmax(np.abs(masses / found - 1.0)))
            raise InputError(
                f"--masses gives particle {i + 1} from the wall the mass {masses[i]:g}, {why} "
                f"{found[i]:g}; expected the masses of the run: drop --masses"
            )
    return [masses], True


def mass_resolution(frame: DumpFrame, layout: ChainLayout, masses: Array) -> Array:
    """
    Return how far masses may be off because a dump prints few digits of them.

    Half a unit of the last digit; 0 where the masses are not those of a column, or all alike, which
    restitution does not depend on.
    """
    if MASS_COLUMN in frame.columns and not are_equal(masses):
        printed = layout.by_body(frame.column(MASS_COLUMN))[0]
        if np.array_equal(masses, printed):
            half = frame.resolution(MASS_COLUMN, frame.significant_digits())
            return layout.by_body(half)[0]
    return np.zeros(masses.size)


def _repeated(masses: ArrayLike, particles: int) -> Array:
    """Repeat k masses along the chain: particle k + 1 has the first again."""
    given = np.atleast_1d(np.asarray(masses, dtype=float))
    wrong = given[~((given > 0.0) & (given < np.inf))]
    if given.size == 0 or wrong.size:
        what = f"a mass is {wrong[0]:g}" if wrong.size else "no mass is given"
        raise InputError(f"{what}; expected positive finite numbers, as in --masses 1,2")
    if given.size > particles:
        raise InputError(
            f"{given.size} masses are given for {particles} particles; expected one a particle "
            "from the wall outwards, or fewer, which are repeated along the chain"
        )
    return np.resize(given, particles)


def _by_id(frame: DumpFrame, n: int, declared: DeclaredMasses) -> tuple[Array | None, str]:
    """Return masses and who says so; or None and why not, empty if nothing says they differ."""
    if MASS_COLUMN in frame.columns:
        return _repeated(frame.column(MASS_COLUMN), n), f"column '{MASS_COLUMN}' of the dump"
    if declared.unclear is not None:
        return None, declared.unclear
    types = frame.column(TYPE_COLUMN) if TYPE_COLUMN in frame.columns else declared.types
    kinds = [] if types is None else [int(kind) for kind in np.unique(types)]
    if not declared.by_type:
        differ = "particles are of types " + ", ".join(map(str, kinds[:5]))
        return None, f"{differ} and no Masses are declared" if len(kinds) > 1 else ""
    missing = [kind for kind in kinds if kind not in declared.by_type]
    if missing:
        return None, f"{declared.source} declares no mass for type {missing[0]}"
    used = {declared.by_type[kind] for kind in kinds} or set(declared.by_type.values())
    if len(used) == 1:
        return _repeated([*used], n), declared.source
    if types is None:
        return None, f"{declared.source} declares several, and the dump has no column 'type'"
    if types.size != n:
        return None, f"{declared.source} has {types.size} atoms, the dump {n}"
    by_particle = [declared.by_type[int(kind)] for kind in types]
    return _repeated(by_particle, n), declared.source
