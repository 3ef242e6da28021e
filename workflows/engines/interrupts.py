"""How much a compiled loop does before Python runs again, which alone sees Ctrl-C and signals."""

# Bond forces, or as much work: 0.02 to 0.2 s by the force, and no call in between for collisions
# of short chains. Nothing else depends on it: loops go on where they stopped, to the last bit.
WORK_AT_ONCE = 20_000_000


def steps_at_once(work: int) -> int:
    """
    Return how many steps, one at least, a compiled loop may take at once.

    `work` is that of one step, in bond forces.
    """
    return max(1, WORK_AT_ONCE // max(1, work))
