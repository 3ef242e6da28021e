"""Tables of known functions, sound and spoiled in 16 ways, judged against the functions."""

import numpy as np


def true_error(report, exact):
    """Return the largest error of LAMMPS's force in a report's range, as part of the local one."""
    judge = report.curves
    at = judge.places(*report.range)
    force = judge.curve(report.style, report.style_rows).force(at)
    return float(np.max(np.abs(force - exact(at)) / local_size(exact, at)))


def local_size(exact, at):
    """Return the largest force within 5 % of the range on both sides, and at least 0.001 of all."""
    low, high = at[0], at[-1]
    fine = np.linspace(low, high, 4001)
    forces = np.abs(exact(fine))
    width = 0.05 * (high - low)
    around = np.stack([np.interp(at + s, fine, forces) for s in np.linspace(-width, width, 81)])
    return np.maximum(np.max(around, axis=0), 1e-3 * np.max(forces))
