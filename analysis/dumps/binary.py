"""Read the binary format of LAMMPS ``dump custom`` (file names ending in ``.bin``)."""

from typing import IO

import numpy as np

from chaincor.analysis.dumps.frame import DumpFrame, TruncatedFrameError
from chaincor.analysis.dumps.text import order_by_id
from chaincor.lammps_inputs.errors import InputError

MAGIC = b"DUMPCUSTOM"


def read_binary_frame(stream: IO[bytes], name: str) -> DumpFrame | None:
    """
    Read the next frame, of revision 2 as LAMMPS has written it since 2020 (``binary2txt.cpp``).

    Numbers are float64 as LAMMPS holds them: no digits are lost and none are converted. `name` is
    that of the file, for errors. Returns None at the end of the file.
    """
    first = stream.read(8)
    if not first:
        return None
    if len(first) < 8:
        raise TruncatedFrameError
    length = -int(np.frombuffer(first, dtype="<i8")[0])
    if length != len(MAGIC) or _take(stream, "S1", length).tobytes() != MAGIC:
        raise InputError(
            f"{name} is not a binary LAMMPS dump of style custom as written since 2020"
        )
    endian, revision = _take(stream, "<i4", 2)
    if endian != 1 or revision < 2:
        raise InputError(
            f"{name} is a binary dump of revision {revision} and byte order {endian}; "
            "expected 2 and little-endian: convert it with LAMMPS's binary2txt"
        )
    step, particles = _take(stream, "<i8", 2)
    triclinic = _take(stream, "<i4", 1)[0]
    boundaries = _take(stream, "<i4", 6)  # lower and upper of x, y, z; 0: periodic
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
            f"{' '.join(columns)}; expected {particles} rows with an 'id'"
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
