"""Reader of the text format of LAMMPS ``dump custom``, frame by frame."""

import itertools
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.frame import DumpFrame, TruncatedFrameError
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError

# A header with a larger number of atoms is damaged.
_MOST_PARTICLES = 10**9
_LATEST_STEP = 2**63


class TextFrames:
    """
    Reader of text frames from an open stream; `name` is the file's name in error messages.

    Columns are converted to numbers on demand. Converting 17 digits to float64 is expensive, and
    splitting a frame into words is cheap.
    """

    style = "custom"  #: Style of the dump.

    def __init__(self, name: str):
        self.name = name
        self._ids: list[bytes] | None = None
        self._order: NDArray[np.int64] | None = None

    def read(self, stream: IO[bytes]) -> DumpFrame | None:
        """Read the next frame; None at the end of the file."""
        header = self._read_header(stream)
        if header is None:
            return None
        particles, said = header
        step, columns = said["step"], said["columns"]
        body = list(itertools.islice(stream, particles))
        if len(body) < particles or (body and not body[-1].endswith(b"\n")):
            raise TruncatedFrameError
        words = self._words(body)
        width = len(columns)
        if len(words) != particles * width:
            raise InputError(
                f"{self.name} is damaged: the frame of step {step} has {len(words)} numbers "
                f"instead of {particles} rows of {width}, perhaps because a crashed run was "
                "continued into this file. Repeat the run, or cut the file before this frame"
            )

        def raw_text(index: int) -> list[bytes]:
            return words[index::width]

        def raw_column(index: int) -> Array:
            try:
                return np.array(list(map(float, words[index::width])))
            except ValueError:
                raise InputError(
                    f"{self.name}: column '{columns[index]}' of the frame of step {step} holds "
                    "text that is not a number"
                ) from None

        if "id" not in columns:
            raise InputError(
                f"{self.name} has no column 'id' (it has {' '.join(columns)}). Dump the ids, "
                "because LAMMPS writes atoms in any order"
            )
        # If a frame has the ids of the previous frame, the sorting is reused.
        index = columns.index("id")
        if raw_text(index) != self._ids:
            self._ids = raw_text(index)
            self._order = order_by_id(raw_column(index), step, self.name)
        return DumpFrame(order=self._order, raw_column=raw_column, raw_text=raw_text, **said)

    def _words(self, body: list[bytes]) -> list[bytes]:
        """Return all words in the rows of a frame."""
        return b"".join(body).split()

    def _step(self, text: bytes | str) -> int:
        step = int(text)
        if abs(step) > _LATEST_STEP:
            raise ValueError
        return step

    def _count(self, text: bytes | str) -> int:
        count = int(text)
        if not 0 <= count <= _MOST_PARTICLES:
            raise ValueError
        return count

    def _read_header(self, stream: IO[bytes]) -> tuple[int, dict[str, Any]] | None:
        """Return the number of particles, and the fields of a frame that its header contains."""
        said: dict[str, Any] = {"time": None, "bounds": np.full((3, 2), np.nan)}
        line = self._first_line(stream)
        if not line:
            return None
        while True:
            if not line.endswith(b"\n"):
                raise TruncatedFrameError
            try:
                if self._read_item(line, said, stream):
                    if "step" not in said or not said.get("columns"):
                        raise ValueError
                    return self._count(said.pop("particles", "-1")), said
            except (ValueError, IndexError):
                raise InputError(
                    f"{self.name} is not a LAMMPS dump of style {self.style}: unexpected "
                    f"{line[:60].decode(errors='replace').strip()!a} in the header of a frame"
                ) from None
            line = stream.readline()

    def _first_line(self, stream: IO[bytes]) -> bytes:
        """Return the first line of a header; empty at the end of the file."""
        return stream.readline()

    def _read_item(self, line: bytes, said: dict[str, Any], stream: IO[bytes]) -> bool:
        """
        Read the item of a header that starts with this line; return whether the header ends.

        Raises ValueError or IndexError if there is no such item.
        """
        words = line.split()
        if words[:1] != [b"ITEM:"]:
            raise ValueError
        if words[1] == b"ATOMS":
            said["columns"] = tuple(word.decode() for word in words[2:])
            return True
        if words[1] == b"TIMESTEP":
            said["step"] = self._step(complete_line(stream))
        elif words[1] == b"TIME":
            said["time"] = float(complete_line(stream))
        elif words[1] == b"NUMBER":
            said["particles"] = self._count(complete_line(stream))
        elif words[1] == b"BOX":
            self._read_box([complete_line(stream).split() for _ in range(3)], said)
            # The line is ITEM: BOX BOUNDS [xy xz yz] pp ff ff.
            said["periodic_x"] = words[-3:-2] == [b"pp"]
        elif words[1] == b"UNITS":
            said["units"] = complete_line(stream).decode().strip()
        else:
            raise ValueError
        return False

    def _read_box(self, rows: list[list[bytes]], said: dict[str, Any]) -> None:
        said["bounds"] = np.array([row[:2] for row in rows], dtype=float)
        said["tilted"] = any(len(row) > 2 for row in rows)


def order_by_id(ids: Array, step: int, name: str) -> NDArray[np.int64] | None:
    """
    Return the indices that sort rows by id; None if the rows are sorted already.

    Raises InputError if there are no ids, an id is no whole number, or an id occurs twice.
    """
    if not ids.size:
        raise InputError(
            f"{name}: the frame of step {step} has no atoms. Dump a group that contains the "
            "chain, or check whether LAMMPS lost all atoms"
        )
    if not np.all((np.abs(ids) < np.inf) & (np.floor(ids) == ids)):
        raise InputError(
            f"{name} is damaged: column 'id' of the frame of step {step} has a value that "
            "is no whole number. Repeat the run"
        )
    order = np.argsort(ids, kind="stable")
    if np.any(ids[order[1:]] == ids[order[:-1]]):
        raise InputError(
            f"{name}: the frame of step {step} is damaged: it holds an id twice. Repeat the run"
        )
    return None if np.array_equal(order, np.arange(ids.size)) else order


def complete_line(stream: IO[bytes]) -> bytes:
    """Return the next line, which must be complete."""
    line = stream.readline()
    if not line.endswith(b"\n"):
        raise TruncatedFrameError
    return line
