"""Build the loop that moves one block of a chain through many substeps."""

from collections.abc import Callable

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference.line_traits import KernelSpec, read_parameters
from chaincor.workflows.engines.reference.motion import FRONT_BLOCK, FRONT_MARGIN
from chaincor.workflows.engines.reference.stages import State, VerletKernels
from chaincor.workflows.engines.schemes import StepCoefficients

# `move` returns six values: the smallest and the largest strain (LOW, HIGH), the same values up to
# the last contact, the number of bonds in motion at the end (ACTIVE), and whether a strain was not
# allowed (OUTSIDE).
LOW, HIGH, CONTACT_LOW, CONTACT_HIGH, ACTIVE, OUTSIDE = range(6)


def build_move(source: KernelSpec, stages: VerletKernels, build_step: Callable) -> Callable:
    """
    Return the loop over the substeps of one block of a chain at a hard wall.

    `build_step` is defined by a scheme, see ``schemes``. A block is computed with a margin on
    either side. The bond beyond the margin is missing, which causes an error. In each substep, this
    error moves inward by the reach of the scheme. If the margin is at least the reach times the
    number of substeps, the block inside the margins moves exactly as in the whole chain.

    ``move(states, scratch, block, log, limits, rule, found)`` moves bonds `first` to `end` through
    the substeps that are recorded in `log`. `states` contains the old state, the new state, and the
    state after the last contact; `scratch` contains three more states. `block` is (first, end,
    begin, stop, is_front): with its margins, the block consists of the bonds `begin` to `stop`;
    `is_front` states that the block ends at the last bond in motion. `limits` contains the smallest
    and largest strain so far, the smallest and largest allowed strain, the strain above which a
    bond counts as moving, and the number of contacts so far. The results are written to `found`.
    """
    take_step = source.register(build_step(stages))
    copy, count_outside, extremes = stages.copy, stages.count_outside, stages.extremes
    slice_parameters = read_parameters(source).slice_parameters

    def move(
        states: tuple[State, State, State],
        scratch: tuple[State, State, State],
        block: tuple[int, int, int, int, bool],
        log: Array,
        limits: tuple[float, float, float, float, float, float],
        rule: StepCoefficients,
        found: Array,
    ) -> None:
        old, new, last = states
        here, there, trial = scratch
        first, end, begin, stop, is_front = block
        low, high, floor, ceiling, threshold, contacts = limits
        old_strain, old_velocity = old.strain[begin:], old.velocity[begin:]
        particles = old.velocity.shape[0]
        rule = StepCoefficients(rule.fractions, slice_parameters(rule.parameters, begin, particles))
        bonds, own = stop - begin, first - begin
        total = old_strain.shape[0]
        last_contact = -1
        for k in range(log.shape[1]):
            if log[1, k] > 0.0:
                last_contact = k
        found[OUTSIDE] = 0.0
        copy(old_strain, old_velocity, here, bonds)
        for k in range(log.shape[1]):
            take_step(0.0, here, there, trial, bonds, bonds, log[0, k], rule)
            here, there = there, here
            strain, velocity = here
            mine = strain[own : end - begin]
            if log[1, k] > 0.0:
                contacts += 1.0
                if contacts == 1.0:  # the range of strains begins at the first contact
                    low, high = extremes(mine, end - first, rule.parameters)
                if begin == 0:
                    velocity[0] = abs(velocity[0])
                if k == last_contact:
                    smallest, largest = extremes(mine, end - first, rule.parameters)
                    found[CONTACT_LOW] = min(low, smallest)
                    found[CONTACT_HIGH] = max(high, largest)
                    for i in range(first, end):
                        last.strain[i] = strain[i - begin]
                        last.velocity[i] = velocity[i - begin]
                    if is_front:
                        last.velocity[end] = velocity[end - begin]
                continue
            if count_outside(mine, end - first, low, high, rule.parameters) > 0:
                smallest, largest = extremes(mine, end - first, rule.parameters)
                low, high = min(low, smallest), max(high, largest)
                if not (smallest > floor and largest < ceiling):
                    found[OUTSIDE] = 1.0
                    return
            # The front advances as in the loop over the whole chain; the state of bonds ahead of
            # the front is unchanged.
            while is_front and bonds < total and abs(strain[bonds - FRONT_MARGIN]) > threshold:
                more = min(total, bonds + FRONT_BLOCK)
                for i in range(bonds, more):
                    strain[i] = old_strain[i]
                    velocity[i + 1] = old_velocity[i + 1]
                bonds = more
                end = begin + bonds
        strain, velocity = here
        for i in range(first, end):
            new.strain[i] = strain[i - begin]
            new.velocity[i] = velocity[i - begin]
        if is_front:
            new.velocity[end] = velocity[end - begin]
        found[LOW], found[HIGH], found[ACTIVE] = low, high, end

    return move
