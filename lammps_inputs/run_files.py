"""Files that a LAMMPS run writes besides its result."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RunFiles:
    """Files that a user wants from a run."""

    dump: Path | None = None  #: Dump of the motion.
    #: Time between the frames of the dump; None if frames are written at contacts.
    frame_interval: float | None = None
    save: Path | None = None  #: Folder of the LAMMPS job.
    scene: str | None = None  #: Text of the scene file in that folder.


NO_FILES = RunFiles()
