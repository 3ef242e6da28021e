"""Test dumps of jobs and of users' runs, with other readers and other files beside dumps."""

import json
import warnings

import MDAnalysis
import numpy as np
import pytest
from ase.io import read

from chaincor.analysis.dumps.dump import Dump
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.units.unit_system import UnitSystem
from chaincor.workflows.job import write_job
from tests.lmp import number, run_lmp

KINDS = {
    "cold": {},
    "masses": {"masses": (1.0, 2.0)},
    "target": {"target_particles": 3},
    "soft": {"contact": "power", "contact_stiffness": 5.0},
    "warm": {"potential": "toda", "velocity": 0.1, "temperature": 1e-3},
    "metal": {},
    "composed": {"scheme": "order4", "timestep": 0.2},
}


@pytest.mark.slow_cases
@pytest.mark.parametrize("kind", KINDS)
def test_other_readers_open_the_dump_of_a_job(kind, tmp_path):
    numerics = {"scheme": "verlet", "timestep": 0.05, "error": False, "dump_frames": 20}
    scene = Scene(particles=5, **(numerics | KINDS[kind]))
    units = UnitSystem(3.822, 39.948, 0.0511, "metal") if kind == "metal" else UnitSystem()
    write_job(scene, tmp_path, dump=True, units=units)
    assert run_lmp(tmp_path).returncode == 0
    path = tmp_path / "dump.lammpstrj"
    frames = list(Dump(path))
    with warnings.catch_warnings():
        # MDAnalysis guesses masses, and the dump has no time between frames
        warnings.simplefilter("ignore")
        universe = MDAnalysis.Universe(
            str(path), format="LAMMPSDUMP", topology_format="LAMMPSDUMP", dt=1.0
        )
    many = read(path, format="lammps-dump-text", index=":")
    assert len(universe.trajectory) == len(many) == len(frames) > 10
    assert universe.atoms.n_atoms == scene.problem.all_particles
    for ts, atoms, frame in zip(universe.trajectory, many, frames, strict=True):
        x, low, v = frame.column("x"), frame.bounds[0, 0], frame.column("vx")
        # MDAnalysis measures from the lower face and rounds twice to 24 bits.
        rounding = 2.0 * float(np.spacing(np.float32(2.0 * abs(low))))
        np.testing.assert_allclose(ts.positions[:, 0] + low, x, rtol=0.0, atol=rounding)
        np.testing.assert_allclose(ts.velocities[:, 0], v, rtol=1e-6, atol=1e-30)
        np.testing.assert_array_equal(atoms.positions[:, 0], x)
        # ASE multiplies all velocities by a constant factor, as if they were in Angstrom per
        # picosecond.
        speeds = atoms.get_velocities()[:, 0]
        factor = speeds[np.argmax(np.abs(v))] / v[np.argmax(np.abs(v))]
        np.testing.assert_allclose(speeds, factor * v, rtol=1e-9, atol=1e-30)
        if kind == "target":
            assert list(frame.column("mol")) == [1.0] * 5 + [2.0] * 3


# This is a user's run in metal units: springs of 0.1 eV/A^2 and 3 A in front of a wall at x = 55.
OWN = """
units metal
boundary f f f
atom_style bond
comm_modify cutoff 9.0
bond_style harmonic
read_data own.data
bond_coeff 1 0.05 3.0
velocity all set 0.5 0 0
fix move all nve
fix wall all wall/reflect xhi 55
timestep 0.002
dump frames all custom 100 own.dump id x vx
dump_modify frames sort id format float %.17g
run 20000
print "restitution = $((vcm(all,x)/0.5)^2:%.15g)"
"""


def own_run(folder, particles=6):
    atoms = [f"{i + 1} 1 1 {54.0 - 3.0 * i} 0 0" for i in range(particles)]
    bonds = [f"{i} 1 {i} {i + 1}" for i in range(1, particles)]
    head = f"own\n\n{particles} atoms\n{particles - 1} bonds\n1 atom types\n1 bond types\n"
    box = "-300 300 xlo xhi\n-9 9 ylo yhi\n-9 9 zlo zhi\n"
    sections = {"Masses": ["1 40.0"], "Atoms # bond": atoms, "Bonds": bonds}
    text = "".join(f"\n{name}\n\n" + "\n".join(rows) + "\n" for name, rows in sections.items())
    (folder / "own.data").write_text(head + box + text)
    (folder / "in.chain").write_text(OWN)
    done = run_lmp(folder)
    assert done.returncode == 0, done.stdout[-1000:]
    return number(done.stdout, "restitution")


def test_wall_side_springs_and_units_are_read_beside_a_dump(tmp_path, chaincor):
    eta = own_run(tmp_path)
    for given in ((), ("--dump", "own.dump")):
        status, out, err = chaincor("analyze", str(tmp_path), *given, "--json")
        assert status == 0, err
        found = json.loads(out)
        assert found["restitution"] == pytest.approx(eta, rel=1e-12)
        units = UnitSystem(3.0, 40.0, 0.1, "metal")
        assert found["velocity"] == pytest.approx(0.5 / units.speed, rel=1e-12)
        assert found["potential"] == "harmonic"
    # The script alone also gives this information, and the wall's other face is written
    # differently.
    (tmp_path / "log.lammps").unlink()
    script = tmp_path / "in.chain"
    script.write_text(script.read_text().replace("xhi 55", "xlo EDGE xhi 55"))
    status, out, _ = chaincor("analyze", str(tmp_path), "--json")
    assert status == 0
    assert json.loads(out)["contacts"] == found["contacts"]


def test_a_run_is_validated_without_a_scene(tmp_path, chaincor):
    own_run(tmp_path)
    status, out, err = chaincor("validate", "--against", str(tmp_path), "--json")
    assert (status, err) == (1, "")
    (result,) = json.loads(out)["validations"]
    assert (result["potential"], result["particles"]) == ("harmonic", 6)
    assert result["note"].endswith("which explains the difference")
    status, _, err = chaincor("validate", "--against", str(tmp_path / "log.lammps"))
    assert status == 2
    assert "Give SCENE.toml" in err
