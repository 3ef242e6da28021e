"""Reader of LAMMPS dumps, frame by frame: text, gzip or binary, complete or incomplete."""

import gzip
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import IO, cast

import numpy as np

from chaincor.analysis.dumps.frame import DumpFrame, DumpFrames, TruncatedFrameError
from chaincor.analysis.dumps.text import TextFrames, order_by_id
from chaincor.analysis.dumps.yaml_text import YAML_START, YamlFrames
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.small_file import refuse_device

_GZIP_MAGIC = b"\x1f\x8b"
_TEXT_START = b"ITEM:"
_BINARY_MAGIC = b"DUMPCUSTOM"


class Dump(DumpFrames):
    """
    LAMMPS dump of style custom or yaml, which is read in constant memory.

    The content of the file decides its format: text (``.lammpstrj``, ``.dump``), gzipped text, or
    binary (``.bin``). Iteration yields one :class:`DumpFrame` at a time and can be repeated. If the
    last frame is incomplete, for example after a crash, the iteration ends before it and sets
    `truncated`. Raises InputError if the file cannot be read, is empty, or is not a dump.
    """

    def __init__(self, path: Path | str):
        self.path = Path(path)
        try:
            with self._open() as (_, stream):
                start = stream.read(18)
        except OSError as error:
            reason = error.strerror or type(error).__name__
            raise InputError(f"cannot read the dump {self.path}: {reason}") from None
        except (EOFError, zlib.error):
            raise InputError(
                f"{self.path} is cut short before its first frame. Repeat the run"
            ) from None
        if not start:
            raise InputError(f"{self.path} is empty. Give a LAMMPS dump of style custom")
        self._is_yaml = start.startswith(YAML_START[:18])
        self.is_text = self._is_yaml or start.startswith(_TEXT_START) or start in _TEXT_START
        if not self.is_text and b"DUMP" not in start:
            raise InputError(
                f"{self.path} is not a LAMMPS dump of style custom: it starts with {start[:18]!r}. "
                "Give the file that 'dump ID all custom' wrote"
            )

    def frames(self, progress: Callable[[int], None] | None = None) -> Iterator[DumpFrame]:
        """
        Yield the frames in the order of the file; a frame remains valid when the next one is read.

        `progress` is called with the number of bytes read so far. Raises InputError if the file is
        damaged, or if no frame is complete.
        """
        name, self.truncated = str(self.path), False
        text = YamlFrames(name) if self._is_yaml else TextFrames(name)
        read = text.read if self.is_text else partial(_read_binary_frame, name=name)
        count = 0
        with self._open() as (file, stream):
            try:
                while (frame := read(stream)) is not None:
                    count += 1
                    yield frame
                    if progress is not None:
                        progress(file.tell())
            except (TruncatedFrameError, EOFError):
                self.truncated = True
            except (gzip.BadGzipFile, zlib.error) as error:
                raise InputError(
                    f"{self.path} is a damaged gzip file: {error}. Give an undamaged copy"
                ) from None
            except ValueError:  # lengths and names of a binary frame may be invalid
                raise InputError(
                    f"{self.path} is damaged in frame {count + 1}, perhaps because a crashed run "
                    "was continued into this file. Repeat the run, or cut the file before this "
                    "frame"
                ) from None
        if count == 0:
            raise InputError(
                f"{self.path} is cut short before the end of its first frame. Repeat the run"
            )

    @contextmanager
    def _open(self) -> Iterator[tuple[IO[bytes], IO[bytes]]]:
        """Yield the open file, and the stream of its decompressed content."""
        refuse_device(self.path)
        with self.path.open("rb") as file:
            compressed = file.read(2) == _GZIP_MAGIC
            file.seek(0)
            if not compressed:
                yield file, file
                return
            with gzip.GzipFile(fileobj=file) as unzipped:
                # A second buffer would lose the last data of a truncated stream.
                yield file, cast(IO[bytes], unzipped)


def _read_binary_frame(stream: IO[bytes], name: str) -> DumpFrame | None:
    """
    Read the next frame in revision 2 of the binary format, which LAMMPS has written since 2020.

    The source of the format is ``binary2txt.cpp``. Numbers are the float64 numbers of LAMMPS,
    without conversion. `name` is the name of the file for error messages. Returns None at the end
    of the file.
    """
    first = stream.read(8)
    if not first:
        return None
    if len(first) < 8:
        raise TruncatedFrameError
    length = -int(np.frombuffer(first, dtype="<i8")[0])
    if length != len(_BINARY_MAGIC) or _take(stream, "S1", length).tobytes() != _BINARY_MAGIC:
        raise InputError(
            f"{name} is not a binary LAMMPS dump of style custom as written since 2020"
        )
    endian, revision = _take(stream, "<i4", 2)
    if endian != 1 or revision < 2:
        raise InputError(
            f"{name} is a binary dump of revision {revision} and byte order {endian}, but "
            "only revision 2, little-endian, can be read. Convert it with LAMMPS's "
            "binary2txt"
        )
    step, particles = _take(stream, "<i8", 2)
    triclinic = _take(stream, "<i4", 1)[0]
    boundaries = _take(stream, "<i4", 6)  # lower and upper face in x, y and z; 0 if periodic
    bounds = _take(stream, "<f8", 6).reshape(3, 2)
    if triclinic:
        _take(stream, "<f8", 3)
    width = int(_take(stream, "<i4", 1)[0])
    units = _take_string(stream).decode() or None
    time = float(_take(stream, "<f8", 1)[0]) if _take(stream, "u1", 1)[0] else None
    columns = tuple(_take_string(stream).decode().split())
    chunks = int(_take(stream, "<i4", 1)[0])
    pieces = [_take(stream, "<f8", int(_take(stream, "<i4", 1)[0])) for _ in range(chunks)]
    values = np.concatenate(pieces).reshape(-1, width)
    if len(values) != particles or len(columns) != width or "id" not in columns:
        raise InputError(
            f"{name}: the frame of step {step} has {len(values)} rows of columns "
            f"{' '.join(columns)}. Give {particles} rows with an 'id'"
        )
    order = order_by_id(values[:, columns.index("id")], int(step), name)
    return DumpFrame(
        int(step),
        time,
        columns,
        bounds,
        order,
        lambda index: values[:, index].copy(),
        periodic_x=bool(boundaries[0] == 0),
        tilted=bool(triclinic),
        units=units,
    )


def _take(stream: IO[bytes], kind: str, count: int) -> np.ndarray:
    dtype = np.dtype(kind)
    data = stream.read(dtype.itemsize * count)
    if len(data) < dtype.itemsize * count:
        raise TruncatedFrameError
    return np.frombuffer(data, dtype=dtype)


def _take_string(stream: IO[bytes]) -> bytes:
    return _take(stream, "S1", int(_take(stream, "<i4", 1)[0])).tobytes()
