"""What other processes are sent is pickled; what cannot be is refused in one line."""

import pickle
from collections.abc import Iterator
from contextlib import contextmanager

from chaincor.lammps_inputs.errors import ChaincorError


@contextmanager
def sent(what: str, to: str, error: type[ChaincorError]) -> Iterator[None]:
    """Raise `error`, which says what cannot be sent to whom, where pickling fails inside."""
    try:
        yield
    except (pickle.PicklingError, AttributeError, TypeError) as reason:
        raise error(
            f"{what} cannot be sent to {to} ({' '.join(str(reason).split())}); expected bonds "
            "whose functions are defined at the top level of a module"
        ) from None
