"""Dump with one file per frame, which LAMMPS writes if the file name contains a ``*``."""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.dumps.frame import DumpFrame, DumpFrames
from chaincor.lammps_inputs.errors import InputError

_DIGITS = re.compile(r"[0-9]+")


def is_pattern(path: Path) -> bool:
    """Return whether a path is a pattern of many files, such as ``dump.*.txt``."""
    return "*" in path.name and not path.exists()


def files_of(path: Path) -> list[Path]:
    """
    Return the files of a pattern in the order of the numbers in their names.

    Raises InputError if no file matches.
    """
    first, _, last = path.name.partition("*")
    numbered = re.compile(re.escape(first) + r"([0-9]{1,18})" + re.escape(last))
    found = [(m, each) for each in path.parent.iterdir() if (m := numbered.fullmatch(each.name))]
    if not found:
        raise InputError(
            f"there is no file {str(path)!r} with a number in place of *. Give the name "
            "under which LAMMPS wrote the dump"
        )
    return [each for _, each in sorted(found, key=lambda pair: int(pair[0][1]))]


class ManyFileDump(DumpFrames):
    """Dump of many files, each with one frame or more."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._files = files_of(path)

    def frames(self, progress: Callable[[int], None] | None = None) -> Iterator[DumpFrame]:
        """Yield the frames of all files; the last file may be incomplete."""
        self.truncated, read = False, 0
        for file in self._files:
            dump = Dump(file)
            frames = dump.frames()
            while True:
                try:
                    frame = next(frames, None)
                except InputError:
                    if file != self._files[-1] or file == self._files[0]:
                        raise
                    self.truncated = True
                    return
                if frame is None:
                    break
                yield frame
            self.truncated = self.truncated or dump.truncated
            read += file.stat().st_size
            if progress is not None:
                progress(read)


def pattern_of(paths: Sequence[Path]) -> Path | None:
    """Return the pattern of LAMMPS's file names; None if the files are not frames of a run."""
    name = paths[0].name
    for run in _DIGITS.finditer(name):
        first, last = name[: run.start()], name[run.end() :]
        numbered = re.compile(re.escape(first) + r"([0-9]{1,18})" + re.escape(last))
        found = [numbered.fullmatch(path.name) for path in paths]
        if all(
            m is not None and _begins_at(path, int(m[1]))
            for path, m in zip(paths, found, strict=True)
        ):
            return paths[0].with_name(f"{first}*{last}")
    return None


def _begins_at(path: Path, step: int) -> bool:
    try:
        return Dump(path).first().step == step
    except InputError:  # the reader reports errors in the file later
        return False
