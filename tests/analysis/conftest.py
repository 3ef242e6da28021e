"""Build an exact harmonic collision and handwritten dumps without the code under test."""

import gzip
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq


@dataclass(frozen=True)
class HarmonicCollision:
    """Collision of a harmonic chain, computed by modes between located contacts."""

    particles: int
    impact_velocity: float
    contact_times: np.ndarray
    contact_speeds: np.ndarray
    amplitudes: tuple  # Position and velocity right after each contact.

    def state(self, time):
        """Return displacements and velocities; before the first contact, the chain moves freely."""
        n, v0 = self.particles, self.impact_velocity
        if time < 0.0:
            return np.full(n, -v0 * time), np.full(n, -v0)
        shapes, omega = modes(n)
        k = int(np.searchsorted(self.contact_times, time, side="right")) - 1
        q, p = propagate(omega, *self.amplitudes[k], time - self.contact_times[k])
        return shapes @ q, shapes @ p


def modes(n):
    """Return mode shapes (columns) and frequencies from their definition, not from a transform."""
    i, j = np.meshgrid(np.arange(1, n + 1), np.arange(n), indexing="ij")
    # Whole numbers are reduced before the cosine, because an argument of 1500 would cost three
    # digits.
    angle = np.pi * ((j * (2 * i - 1)) % (4 * n)) / (2 * n)
    shapes = np.cos(angle) * np.where(j == 0, 1.0, np.sqrt(2.0)) / np.sqrt(n)
    return shapes, 2.0 * np.sin(0.5 * np.pi * np.arange(n) / n)


def propagate(omega, q, p, t):
    sine = t * np.sinc(omega * t / np.pi)
    return q * np.cos(omega * t) + p * sine, p * np.cos(omega * t) - omega**2 * q * sine


def find_crossing(end, omega, q, p, horizon):
    """Return two times between which particle 1 passes x = 0, or None."""
    steps = 0.05 * np.arange(1, int(horizon / 0.05))
    x = np.array([end @ propagate(omega, q, p, t)[0] for t in steps])
    below = np.flatnonzero(x < 0.0)
    return (steps[below[0] - 1], steps[below[0]]) if below.size else None


def collide_harmonic(n, v0=0.1):
    """Compute the collision in mode amplitudes alone: transforms at contacts would lose digits."""
    shapes, omega = modes(n)
    end = shapes[0]
    q, p, time = np.zeros(n), shapes.T @ np.full(n, -v0), 0.0
    times, speeds, amplitudes = [], [], []
    while True:
        speed = -float(end @ p)
        p = p + 2.0 * speed * end
        times.append(time)
        speeds.append(speed)
        amplitudes.append((q, p))
        # Contacts are 1.5 to 6 time units apart. After the last contact, sound returns after a time
        # 2 n.
        bracket = find_crossing(end, omega, q, p, 4.0) or find_crossing(
            end, omega, q, p, 2.2 * n + 10.0
        )
        if bracket is None:
            return HarmonicCollision(n, v0, np.array(times), np.array(speeds), tuple(amplitudes))
        wait = brentq(
            lambda t, q=q, p=p: float(end @ propagate(omega, q, p, t)[0]),
            *bracket,
            xtol=1e-14,
            rtol=1e-14,
        )
        q, p = propagate(omega, q, p, wait)
        time += wait


@pytest.fixture(scope="session")
def harmonic20():
    return collide_harmonic(20)


@pytest.fixture(scope="session")
def harmonic500():
    return collide_harmonic(500)


def frame_text(
    step, rows, columns, fmt="%.17g", time=None, bounds=(-10.0, 200.0), box="ff pp pp", units=None
):
    """Return one frame as LAMMPS writes it; the first column is the id."""
    head = f"ITEM: UNITS\n{units}\n" if units is not None else ""
    head += f"ITEM: TIME\n{float(time)!r}\n" if time is not None else ""
    lines = [" ".join([str(int(row[0])), *(fmt % value for value in row[1:])]) for row in rows]
    return (
        f"{head}ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(rows)}\n"
        f"ITEM: BOX BOUNDS {box}\n{bounds[0]!r} {bounds[1]!r}\n-0.5 0.5\n-0.5 0.5\n"
        f"ITEM: ATOMS {columns}\n" + "\n".join(lines) + "\n"
    )


@dataclass(frozen=True)
class DumpWriter:
    """Writer of a collision in any form that a dump may have."""

    folder: Path

    def write(
        self,
        collision,
        times,
        name="dump.lammpstrj",
        columns="id x vx v_displacement v_time",
        fmt="%.17g",
        timestep=0.005,
        shuffle=False,
        reverse_ids=False,
        cut=0,
        time_item=False,
        moving_box=False,
        wrap=None,
        box="ff pp pp",
        units=None,
        sideways=0.0,
    ):
        rng = np.random.default_rng(5)
        n = collision.particles
        frames = []
        for time in times:
            u, v = collision.state(time)
            x = u + np.arange(n)
            low, high = (-10.0 - time, 200.0 + time) if moving_box else (-10.0, 200.0)
            images = np.zeros(n)
            if wrap is not None:  # a periodic box that starts at 0
                low, high = 0.0, wrap
                images = np.floor(x / wrap)
            wrapped = x - images * (high - low)
            ids = np.arange(n, 0, -1) if reverse_ids else np.arange(1, n + 1)
            known = {
                "id": ids,
                "type": np.ones(n),
                "x": wrapped,
                "xu": x,
                "ix": images,
                "xs": (wrapped - low) / (high - low),
                "y": np.zeros(n),
                "z": np.zeros(n),
                "vx": v,
                "vy": np.full(n, sideways),
                "vz": np.zeros(n),
                "v_displacement": u,
                "v_time": np.full(n, time),
            }
            rows = np.column_stack([known[column] for column in columns.split()])
            if shuffle:
                rng.shuffle(rows)
            step = round((time - times[0]) / timestep)
            written = time if time_item else None
            frames.append(
                frame_text(step, rows, columns, fmt, written, (float(low), float(high)), box, units)
            )
        data = "".join(frames).encode()
        data = data[: len(data) - cut] if cut else data
        path = self.folder / name
        path.write_bytes(gzip.compress(data) if name.endswith(".gz") else data)
        return path


@pytest.fixture
def dump_writer(tmp_path):
    return DumpWriter(tmp_path)


@pytest.fixture
def bounce(tmp_path):
    """Return a function that writes three frames of a particle that bounces off the wall."""

    def write(speed):
        states = enumerate([(0.15, -0.1), (0.05, -0.1), (0.05, speed)])
        frames = (frame_text(step, [(1, x, v)], "id x vx") for step, (x, v) in states)
        (tmp_path / "one").write_text("".join(frames))
        return tmp_path / "one"

    return write
