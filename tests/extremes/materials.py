"""Provide small, quick, valid inputs of every kind, from which bad inputs are made."""

import io
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.work import collide_to_rows
from chaincor.workflows.collision import collide
from chaincor.workflows.job import write_job
from chaincor.workflows.result import Collision
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row

SCENES = (
    'potential = "lj"\nparticles = 3\nspeed = 0.4\ntolerance = 1e-4\nengine = "reference"\n',
    'potential = "harmonic"\nparticles = 4\nvelocity = 0.1\ntolerance = 1e-5\n',
    'potential = "toda"\ntoda_b = 10.0\nparticles = 2\nspeed = 1.0\nscheme = "order8"\n'
    "timestep = 0.05\nerror = false\n",
    'potential = "power"\npower_order = 4\npower_c = 1.0\nparticles = 3\nspeed = 0.3\n'
    'wall = "event"\nscheme = "verlet"\ntimestep = 0.02\ntable = "spline"\ntable_points = 501\n',
    'potential = "log"\nparticles = 2\nvelocity = 0.2\nwall = "reflect"\ntimestep = 0.01\n'
    "error = false\n",
    'potential = "formula"\nenergy = "D*(1-exp(-a*s))^2"\nparticles = 3\nspeed = 0.4\n'
    'engine = "reference"\ntolerance = 1e-4\n[parameters]\nD = 0.0139\na = 6.0\n',
    'potential = "table"\nbond_file = "bond.table"\nparticles = 3\nvelocity = 0.02\n'
    'engine = "reference"\nscheme = "order4"\ntimestep = 0.1\n',
)

SWEEPS = (
    '[scene]\npotential = "lj"\nengine = "reference"\ntolerance = 1e-4\n'
    "[axes]\nparticles = [2, 3]\nspeed = {from = 0.1, to = 1.0, points = 3}\n",
    'store = "results.sqlite"\narrays = true\nzip = [["particles", "velocity"]]\n'
    '[scene]\npotential = "harmonic"\n[axes]\nparticles = [2, 3, 4]\n'
    'velocity = {from = 0.01, to = 0.1, points = 3, spacing = "log"}\n',
    '[scene]\nparticles = 3\n[axes]\nchain = [{potential = "lj", speed = 0.1}, '
    '{potential = "toda", toda_b = 2.0, speed = 0.2}]\n',
)


@dataclass(frozen=True)
class Materials:
    """Files as bytes."""

    job: dict[str, bytes]  #: Names and contents of a folder with a job and the dump of its run.
    store: bytes  #: A results store with a few rows, arrays and failures.
    table: bytes  #: A LAMMPS bond table.
    #: Final velocities of three particles, in the form that a user's integrator writes.
    final_csv: bytes
    final_npz: bytes  #: See ``final_csv``.


@cache
def materials() -> Materials:
    """Make the files by running chaincor itself."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        scene = Scene(particles=3, speed=0.4, scheme="order6", dump=folder / "d", dump_frames=5.0)
        result = collide(scene)
        job = folder / "job"
        write_job(Scene(particles=3, speed=0.4, table_points=101), job)
        (folder / "d").rename(job / "dump.lammpstrj")
        with Store(folder / "s.sqlite") as store:
            crossing = Scene(potential="harmonic", particles=2, velocity=5.0)
            (failed,) = collide_to_rows([crossing])
            assert failed is not None
            store.record([(scene, Row.of(result)), (crossing, failed)], arrays=True)
        table = tabulate(LennardJones(), (0.9, 1.1), "spline", 41)
        return Materials(
            job={path.name: path.read_bytes() for path in job.iterdir()},
            store=(folder / "s.sqlite").read_bytes(),
            table=table.to_text().encode(),
            final_csv=_final_csv(result),
            final_npz=_final_npz(result),
        )


def _final_csv(result: Collision) -> bytes:
    rows = [f"{v!r},{u!r}" for v, u in zip(result.velocities, result.displacements, strict=True)]
    return "\n".join(["velocity,displacement", *rows, ""]).encode()


def _final_npz(result: Collision) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, velocities=result.velocities, displacements=result.displacements)
    return buffer.getvalue()
