"""Named errors whose messages say what was given, what was expected and what to do."""


class ChaincorError(Exception):
    """
    Base of every error chaincor raises on purpose; the message is one clear line.

    Attributes
    ----------
    exit_status : int
        What the command line returns: 2 for bad input, 1 for a failed run.
    """

    exit_status = 1


class InputError(ChaincorError):
    """The scene, a file or an option cannot be used as given."""

    exit_status = 2


class SceneError(InputError):
    """A scene holds a value that makes no sense, or values that contradict each other."""


class PotentialError(InputError):
    """A bond potential has impossible parameters or no stable natural length."""


class TableError(InputError):
    """A bond table is malformed, too short, or cannot hold the scene."""
