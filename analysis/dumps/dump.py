"""Dumps of LAMMPS, streamed frame by frame: text, gzip or binary, whole or cut short."""

import gzip
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import IO, cast

from chaincor.analysis.dumps.binary import read_binary_frame
from chaincor.analysis.dumps.frame import DumpFrame, Frames, TruncatedFrameError
from chaincor.analysis.dumps.text import TextFrames
from chaincor.lammps_inputs.errors import InputError

_GZIP_MAGIC = b"\x1f\x8b"
_TEXT_START = b"ITEM:"


class Dump(Frames):
    """
    A LAMMPS dump of style custom, read in constant memory.

    Text (``.lammpstrj``, ``.dump``), the same gzipped, or binary (``.bin``): what it is, is seen
    from its content. Iterating yields a :class:`DumpFrame` at a time and can be repeated. A last
    frame that is cut short, as a crash leaves it, ends the iteration and sets `truncated`. Raises
    InputError if the file cannot be read, is empty, or is not a dump.
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
            raise InputError(f"{self.path} is cut short before its first frame") from None
        if not start:
            raise InputError(f"{self.path} is empty; expected a LAMMPS dump of style custom")
        self.is_text = start.startswith(_TEXT_START) or start in _TEXT_START
        if not self.is_text and b"DUMP" not in start:
            raise InputError(
                f"{self.path} is not a LAMMPS dump of style custom: it starts with {start[:18]!r}"
            )

    def frames(self, progress: Callable[[int], None] | None = None) -> Iterator[DumpFrame]:
        """
        Yield the frames in the order of the file; each stays valid after the next has been read.

        `progress` is told the number of bytes of the file read so far. Raises InputError if the
        file is damaged, or not even one frame is complete.
        """
        name, self.truncated = str(self.path), False
        read = TextFrames(name).read if self.is_text else partial(read_binary_frame, name=name)
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
                raise InputError(f"{self.path} is a damaged gzip file: {error}") from None
        if count == 0:
            raise InputError(f"{self.path} is cut short before the end of its first frame")

    @contextmanager
    def _open(self) -> Iterator[tuple[IO[bytes], IO[bytes]]]:
        """Open the file; yield it and the stream of its decompressed content."""
        with self.path.open("rb") as file:
            compressed = file.read(2) == _GZIP_MAGIC
            file.seek(0)
            if not compressed:
                yield file, file
                return
            with gzip.GzipFile(fileobj=file) as unzipped:
                # No further buffer: it would lose what precedes the end of a cut stream.
                yield file, cast(IO[bytes], unzipped)
