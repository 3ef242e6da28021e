"""Build a job with two kinds of particles, run it in LAMMPS, and compute its exact restitution."""

import re
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.job import write_job
from tests.lmp import number, run_lmp

PARTICLES = 20
VELOCITY = 0.1
MASSES = np.tile([1.0, 10.0], PARTICLES // 2)
COLUMNS = "id type mass x vx v_displacement v_time"


def run_two_masses(folder: Path, timestep: float = 0.01) -> float:
    """Run 20 particles of masses 1, 10, 1, ...; return the restitution that LAMMPS prints."""
    scene = Scene(
        potential="harmonic",
        particles=PARTICLES,
        velocity=VELOCITY,
        scheme="verlet",
        timestep=timestep,
    )
    write_job(scene, folder, dump=True)
    data = (folder / "chain.data").read_text()
    data = data.replace("1 atom types", "2 atom types")
    data = data.replace("Masses\n\n1 1.0\n", "Masses\n\n1 1.0\n2 10.0\n")
    data = re.sub(
        r"^(\d+) 1 1 (\S+) 0 0$",
        lambda row: f"{row[1]} 1 {2 - int(row[1]) % 2} {row[2]} 0 0",
        data,
        flags=re.MULTILINE,
    )
    (folder / "chain.data").write_text(data)
    script = (folder / "in.chain").read_text()
    script = script.replace("id type x y z vx vy vz v_displacement v_time", COLUMNS)
    # The script's argument for the end assumes equal masses. The run therefore continues for longer
    # than the round trip of sound.
    further = f"label           over\nrun {round(100.0 / timestep)} pre no post no"
    (folder / "in.chain").write_text(script.replace("label           over", further))
    # LAMMPS itself weights vcm(all,x) by mass.
    return number(run_lmp(folder).stdout, "restitution")


def keep_columns(dump: Path, columns: str) -> None:
    """Rewrite a dump with some of its columns, and with constants as further columns."""
    lines = []
    places: list[int] = []
    for line in dump.read_text().splitlines():
        if line.startswith("ITEM: ATOMS"):
            names = line.split()[2:]
            places = [names.index(name) for name in columns.split()]
            lines.append(f"ITEM: ATOMS {columns}")
        elif line.startswith("ITEM:"):
            places = []
            lines.append(line)
        elif places:
            words = line.split()
            lines.append(" ".join(words[place] for place in places))
        else:
            lines.append(line)
    dump.write_text("\n".join(lines) + "\n")


def exact_restitution() -> float:
    """Integrate the same collision by SciPy with located contacts, independently of the package."""
    n = PARTICLES
    state = np.concatenate((np.zeros(n), np.full(n, -VELOCITY)))
    state[n] = VELOCITY
    time = 0.0

    def motion(_time, y):
        pull = np.diff(y[:n])
        force = np.zeros(n)
        force[:-1] += pull
        force[1:] -= pull
        return np.concatenate((y[n:], force / MASSES))

    def distance(_time, y):
        return y[0]

    distance.terminal = True
    distance.direction = -1
    # The last contact is at t = 93; the round trip of sound takes 2 n sqrt(5.5) = 94.
    while time < 200.0:
        path = solve_ivp(
            motion, (time, 200.0), state, method="DOP853", rtol=1e-11, atol=1e-13, events=distance
        )
        state, time = path.y[:, -1].copy(), float(path.t[-1])
        if path.status == 1:
            state[0], state[n] = 0.0, -state[n]
    return float((MASSES @ state[n:] / MASSES.sum() / VELOCITY) ** 2)
