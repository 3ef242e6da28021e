"""Reader of LAMMPS ``dump yaml``, which has the columns of ``dump custom`` in another format."""

from typing import IO, Any

from chaincor.analysis.dumps.text import TextFrames, complete_line

YAML_START = b"---\ncreator: LAMMPS"
_END = b"..."


class YamlFrames(TextFrames):
    """Reader of YAML frames from an open stream."""

    style = "yaml"

    def _words(self, body: list[bytes]) -> list[bytes]:
        rows = (line.partition(b"[")[2].partition(b"]")[0] for line in body)
        return b" ".join(rows).replace(b",", b" ").split()

    def _first_line(self, stream: IO[bytes]) -> bytes:
        line = stream.readline()
        while line.strip() == _END:  # of the previous frame
            line = stream.readline()
        return line

    def _read_item(self, line: bytes, said: dict[str, Any], stream: IO[bytes]) -> bool:
        key, _, value = line.decode(errors="replace").partition(":")
        words = value.strip(" \n[]").replace(",", " ").split()
        if key == "timestep":
            said["step"] = self._step(value)
        elif key == "time":
            said["time"] = float(value)
        elif key == "units":
            said["units"] = value.strip()
        elif key == "natoms":
            said["particles"] = self._count(value)
        elif key == "boundary":
            said["periodic_x"] = words[0] == "p"
        elif key == "box":
            self._read_box([self._words([complete_line(stream)]) for _ in range(3)], said)
        elif key == "keywords":
            said["columns"] = tuple(words)
        elif key == "data":
            return True
        elif key.strip() not in ("---", "creator", "thermo") and not key.startswith(" "):
            raise ValueError
        return False
