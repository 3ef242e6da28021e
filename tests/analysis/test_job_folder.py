import gzip
import shutil

import numpy as np
import pytest

from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import count_atoms_and_bonds, find_job
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError

DATA = (
    "chain\n\n{n} atoms\n{b} bonds\n1 atom types\n\n-10 200 xlo xhi\n\nMasses\n\n1 1\n\nAtoms\n\n"
)
SCRIPT = "units lj\natom_style bond\nread_data my.data\nfix 1 all nve\ntimestep 0.005\nrun 100\n"
TIMES = np.arange(0.0, 90.0, 1.0)


@pytest.fixture
def job_folder(harmonic20, dump_writer):
    dump_writer.write(harmonic20, TIMES, name="out.custom", columns="id x vx")
    (dump_writer.folder / "my.data").write_text(DATA.format(n=20, b=19))
    (dump_writer.folder / "in.mine").write_text(SCRIPT)
    (dump_writer.folder / "log.lammps").write_text("LAMMPS (22 Jul 2025)\n" + SCRIPT)
    (dump_writer.folder / "notes.md").write_text("run 1 of 2\n")
    return dump_writer.folder


def test_files_are_found_by_what_they_are(job_folder):
    job = find_job(job_folder)
    assert (job.dump.name, job.data.name, job.scene) == ("out.custom", "my.data", None)
    assert [path.name for path in job.scripts] == ["in.mine"]
    assert [path.name for path in job.logs] == ["log.lammps"]
    assert count_atoms_and_bonds(job.data) == (20, 19)


def test_a_gzipped_data_file_is_that_of_the_job_as_well(job_folder):
    packed = job_folder / "my.data.gz"
    packed.write_bytes(gzip.compress((job_folder / "my.data").read_bytes()))
    (job_folder / "my.data").unlink()
    assert count_atoms_and_bonds(packed) == (20, 19)
    assert analyze_job(find_job(job_folder, data=packed), bond=Harmonic()).contacts == 17
    packed.write_bytes(packed.read_bytes()[:30] + b"damaged")
    with pytest.raises(InputError, match="Give a LAMMPS data file"):
        count_atoms_and_bonds(packed)


def test_a_job_is_analysed_with_what_its_files_know(job_folder):
    analysis = analyze_job(find_job(job_folder), bond=Harmonic())
    assert analysis.timestep == 0.005
    assert analysis.contacts == 17
    (job_folder / "scene.toml").write_text(
        'potential = "harmonic"\nparticles = 20\nvelocity = 0.1\n'
    )
    from_scene = analyze_job(find_job(job_folder))
    assert from_scene.bond == Harmonic()
    assert from_scene.restitution == pytest.approx(analysis.restitution, rel=1e-14)


def test_without_script_and_log_the_timestep_is_inferred(job_folder):
    (job_folder / "in.mine").unlink()
    (job_folder / "log.lammps").unlink()
    analysis = analyze_job(find_job(job_folder))
    assert analysis.timestep == pytest.approx(0.005, rel=1e-6)
    assert any("from the flight of the last particle" in caveat for caveat in analysis.caveats)


def test_the_reflecting_wall_is_warned_of(job_folder):
    assert not any("wall/reflect" in c for c in analyze_job(find_job(job_folder)).caveats)
    (job_folder / "in.mine").write_text(SCRIPT + "fix 2 all wall/reflect xlo 0.0\n")
    assert any("wall/reflect" in c for c in analyze_job(find_job(job_folder)).caveats)


@pytest.mark.parametrize(("particles", "source"), [(21, "my.data"), (19, "my.data")])
def test_a_wrong_number_of_atoms_is_an_error(job_folder, particles, source):
    (job_folder / source).write_text(DATA.format(n=particles, b=particles - 1))
    with pytest.raises(InputError, match=rf"has 20 particles, but .*{source} has {particles}"):
        analyze_job(find_job(job_folder))


def test_what_to_take_must_be_clear(job_folder, tmp_path):
    shutil.copy(job_folder / "out.custom", job_folder / "again.custom")
    with pytest.raises(InputError, match=r"several dump files \(again.custom, out.custom\)"):
        find_job(job_folder)
    assert find_job(job_folder, dump=job_folder / "out.custom").dump.name == "out.custom"
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match=r"holds no LAMMPS dump.*name it"):
        find_job(empty)
    (empty / "dump.lammpstrj").touch()
    with pytest.raises(InputError, match=r"dump.lammpstrj is empty"):
        find_job(empty)
    with pytest.raises(InputError, match="is not a folder"):
        find_job(tmp_path / "nowhere")
    with pytest.raises(InputError, match="is not a LAMMPS data file"):
        count_atoms_and_bonds(job_folder / "notes.md")
    with pytest.raises(InputError, match="cannot read"):
        count_atoms_and_bonds(job_folder / "none")
