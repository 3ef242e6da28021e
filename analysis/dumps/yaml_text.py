"""Reader of LAMMPS ``dump yaml``, which has the columns of ``dump custom`` in another text."""

from typing import IO, Any

import numpy as np

from chaincor.analysis.dumps.frame import TruncatedFrameError
from chaincor.analysis.dumps.text import TextFrames, complete_line
from chaincor.lammps_inputs.errors import InputError

YAML_START = b"---\ncreator: LAMMPS"
_END = b"..."


class YamlFrames(TextFrames):
    """Reader of YAML frames from an open stream."""

    def _words(self, body: list[bytes]) -> list[bytes]:
        rows = (line.partition(b"[")[2].partition(b"]")[0] for line in body)
        return b" ".join(rows).replace(b",", b" ").split()

    def _read_header(self, stream: IO[bytes]) -> tuple[int, dict[str, Any]] | None:
        said: dict[str, Any] = {"time": None, "bounds": None}
        particles, line = None, stream.readline()
        while line.strip() == _END:  # of the frame before
            line = stream.readline()
        if not line:
            return None
        while True:
            if not line.endswith(b"\n"):
                raise TruncatedFrameError
            key, _, value = line.decode(errors="replace").partition(":")
            words = value.strip(" \n[]").replace(",", " ").split()
            try:
                if key == "timestep":
                    said["step"] = self._step(value)
                elif key == "time":
                    said["time"] = float(value)
                elif key == "units":
                    said["units"] = value.strip()
                elif key == "natoms":
                    particles = self._count(value)
                elif key == "boundary":
                    said["periodic_x"] = words[0] == "p"
                elif key == "box":
                    rows = [self._words([complete_line(stream)]) for _ in range(3)]
                    said["bounds"] = np.array([row[:2] for row in rows], dtype=float)
                    said["tilted"] = any(len(row) > 2 for row in rows)
                elif key == "keywords":
                    said["columns"] = tuple(words)
                elif key == "data":
                    if particles is None or "step" not in said or not said.get("columns"):
                        raise ValueError
                    return particles, said
                elif key.strip() not in ("---", "creator", "thermo") and not key.startswith(" "):
                    raise ValueError
            except (ValueError, IndexError):
                raise InputError(
                    f"{self.name} is not a LAMMPS dump of style yaml: unexpected "
                    f"{line[:60].decode(errors='replace').strip()!a} in the header of a frame"
                ) from None
            line = stream.readline()
