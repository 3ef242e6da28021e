"""How many cores one collision may use, and which are this process's own."""

import os
import threading
from multiprocessing import parent_process

from chaincor.workflows.versions import cores_allowed


def cores() -> int:
    """
    Return how many cores one collision may use.

    Those of this process, but no more than ``OMP_NUM_THREADS``, where that is a number.
    """
    found = own_cores()
    wanted = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, min(found, int(wanted))) if wanted.isdecimal() else found


def own_cores() -> int:
    """
    Return how many cores are this process's own.

    One in worker processes, and in threads that somebody else started: there, collisions are
    carried out side by side. Elsewhere all that it may use.
    """
    if parent_process() is not None or threading.current_thread() is not threading.main_thread():
        return 1
    return cores_allowed()
