"""Compile and run a short C++ program that integrates a column of beads by velocity Verlet."""

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

_SOURCE = Path(__file__).with_name("column.cpp")


@dataclass(frozen=True)
class VerletRun:
    """Loss of a column of beads, from a run at one time step."""

    loss: float  #: 1 - eta.
    last_contact_time: float
    seconds: float  #: Processor time of the loop.


@dataclass(frozen=True)
class VerletColumn:
    """The compiled program."""

    program: Path

    @classmethod
    def compiled_in(cls, folder: Path) -> "VerletColumn":
        """Compile the program in a folder."""
        program = folder / "column"
        options = ["-O3", "-march=native", "-ffast-math"]
        subprocess.run(["g++", *options, str(_SOURCE), "-o", str(program)], check=True)
        return cls(program)

    def run(self, exponent: float, hard: bool, beads: int, timestep: float) -> VerletRun:
        """Run a column of touching beads with mass 1 and impact speed 1."""
        arguments = [str(exponent), str(int(hard)), str(beads), repr(timestep)]
        command = [str(self.program), *arguments]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return VerletRun(*map(float, printed.split()))

    def extrapolated(
        self, exponent: float, hard: bool, beads: int, steps: Sequence[float] = (0.04, 0.02, 0.01)
    ) -> tuple[float, float]:
        """Return 1 - eta without its error of second order, and the change of the last halving."""
        losses = [self.run(exponent, hard, beads, step).loss for step in steps]
        better = [(4 * b - a) / 3 for a, b in pairwise(losses)]
        return better[-1], abs(better[-1] - (better[-2] if len(better) > 1 else losses[-1]))
