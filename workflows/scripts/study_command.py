"""Write the command that would repeat a study, with other options where these are given."""

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

DEFAULT_TIMEOUT = 600.0


@dataclass(frozen=True)
class StudyCommand:
    """Command of a study, as a user would type it again."""

    base: tuple[str, ...] = ()  #: Words of the command, without the options in the other fields.
    ladder: tuple[str, ...] = ()  #: The option ``--vary``; empty for the default ladder.
    runs: tuple[str, ...] = ()  #: The option ``--seeds`` or ``--phases``; empty for the default.
    limit: tuple[str, ...] = ()  #: The option ``--timeout``; empty for the default.

    def again(
        self,
        *more: str,
        ladder: str | None = None,
        runs: tuple[str, int] | None = None,
        limit: float | None = None,
    ) -> str:
        """
        Return the command with another ladder, number of runs or time limit as one line.

        The words in `more` are appended.
        """
        words = [*self.base]
        words += self.ladder if ladder is None else ["--vary", ladder]
        words += self.runs if runs is None else [runs[0], str(runs[1])]
        words += self.limit if limit is None else ["--timeout", str(math.ceil(limit))]
        return shlex.join([*words, *more])


def study_command(
    script: Path | str,
    quantities: Sequence[str],
    *,
    observable: str | None,
    vary: str | None,
    fix: Sequence[str],
    seeds: int | None,
    phases: int | None,
    tolerance: float | None,
    scale_periods: bool,
    lmp: str | None,
    timeout: float,
) -> StudyCommand:
    """Return the command of a study from its options."""
    base = ["chaincor", "timestep", str(script), *quantities]
    base += [] if observable is None else ["--observable", observable]
    base += [word for each in fix for word in ("--fix", each)]
    base += [] if tolerance is None else ["--tolerance", f"{tolerance:.12g}"]
    base += ["--scale-periods"] if scale_periods else []
    base += [] if lmp is None else ["--lmp", lmp]
    given = {"--seeds": seeds, "--phases": phases}
    return StudyCommand(
        base=tuple(base),
        ladder=() if vary is None else ("--vary", vary),
        runs=tuple(w for name, n in given.items() if n is not None for w in (name, str(n))),
        limit=() if timeout == DEFAULT_TIMEOUT else ("--timeout", f"{timeout:g}"),
    )
