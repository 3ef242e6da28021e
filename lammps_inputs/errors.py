"""Errors of the package. Each message gives the problem and the remedy."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

# Names in other programs, and the names that chaincor uses instead.
_ELSEWHERE = {
    **dict.fromkeys(("lennard-jones", "lennardjones", "lj/cut", "12-6"), "lj"),
    **dict.fromkeys(("spring", "hooke", "linear", "harm"), "harmonic"),
    **dict.fromkeys(("fput", "fpu", "quartic", "cubic"), "power"),
    **dict.fromkeys(("n", "natoms", "atoms", "size", "length"), "particles"),
    **dict.fromkeys(("v", "v0", "vel"), "velocity"),
    **dict.fromkeys(("dt", "h", "step", "time-step"), "timestep"),
    **dict.fromkeys(("tol", "eps", "accuracy", "precision"), "tolerance"),
    **dict.fromkeys(("t", "temp", "kt"), "temperature"),
    **dict.fromkeys(("b",), "toda-b"),
    **dict.fromkeys(("mass", "m"), "masses"),
    **dict.fromkeys(("bond", "pot", "pair-style", "bond-style"), "potential"),
    **dict.fromkeys(("method", "integrator", "order"), "scheme"),
    **dict.fromkeys(("simulate", "collide", "start"), "run"),
}

# Longer words are not compared with names: they resemble no name, and the comparison is slow.
_LONGEST_WORD = 60


class ChaincorError(Exception):
    """Base class of all errors that chaincor raises intentionally; the message is one line."""

    #: Exit status of the command line: 2 for bad input, 1 for a failed run.
    exit_status = 1


class InputError(ChaincorError):
    """Error: the scene, a file or an option cannot be used as given."""

    exit_status = 2


class SceneError(InputError):
    """Error: a scene has an invalid value, or values that contradict each other."""

    #: All mistakes, if there are several; the message has one line per mistake.
    mistakes: tuple[str, ...] = ()

    @classmethod
    def of(cls, mistakes: Sequence[str], source: str | None = None) -> "SceneError":
        """Return an error with all mistakes of a scene, under a heading if there are several."""
        if len(mistakes) == 1:
            return cls(*mistakes)
        where = "" if source is None else f"{source}: "
        lines = tuple(" ".join(mistake.split()) for mistake in mistakes)
        found = cls("\n  ".join((f"{where}{len(lines)} mistakes:", *lines)))
        found.mistakes = lines
        return found


def one_line(error: BaseException) -> str:
    """Return the message of an error in one line, or an empty text if it has no message."""
    return " ".join(str(error).split())


@contextmanager
def mistakes_in(source: object) -> Iterator[None]:
    """Add the location of the mistakes to a SceneError with several mistakes."""
    try:
        yield
    except SceneError as error:
        if not error.mistakes:
            raise
        raise SceneError.of(error.mistakes, str(source)) from None


class PotentialError(InputError):
    """Error: a bond potential has impossible parameters or no stable natural length."""


class TableError(InputError):
    """Error: a bond table is malformed, too short, or does not cover the scene."""


def meant(word: str, known: Iterable[str]) -> str | None:
    """Return the known word most similar to an unknown word; None if no word is similar."""
    if len(word) > _LONGEST_WORD:
        return None
    names = {name.lower().replace("_", "-"): name for name in known}
    plain = word.lower().strip("-").replace("_", "-")
    if plain in names:
        return names[plain]
    elsewhere = _ELSEWHERE.get(plain)
    if elsewhere in names:
        return names[elsewhere]
    from difflib import get_close_matches

    near = get_close_matches(plain, names, n=1, cutoff=0.7)
    return names[near[0]] if near else None
