"""Compute statistics of the contacts of particle 1 with the wall."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class ContactStatistics:
    """Statistics of a list of contacts; means without data are None."""

    count: int  #: Number f of contacts, including the first contact.
    per_particle: float  #: Contacts per particle, f/n.
    last_time: float | None  #: Duration of the collision, from the first contact to the last.
    #: Mean and median of the interval between contacts.
    mean_interval: float | None
    median_interval: float | None  #: See ``mean_interval``.
    mean_speed: float | None  #: Mean incoming speed in units of the impact speed v0.


def contact_statistics(
    contact_times: ArrayLike,
    contact_speeds: ArrayLike,
    particles: int,
    impact_velocity: float,
) -> ContactStatistics:
    """
    Summarise a list of contacts.

    Parameters
    ----------
    contact_times, contact_speeds : array_like of shape (f,)
        Times at which particle 1 hit the wall, and its incoming speeds (> 0).
    particles : int
        Number of particles in the chain.
    impact_velocity : float
        Impact speed v0.

    Returns
    -------
    ContactStatistics
        Count, f/n, duration, intervals and mean incoming speed.
    """
    times = np.asarray(contact_times, dtype=float)
    speeds = np.asarray(contact_speeds, dtype=float)
    intervals = np.diff(times)
    some = intervals.size > 0
    return ContactStatistics(
        count=int(times.size),
        per_particle=times.size / particles,
        last_time=float(times[-1] - times[0]) if times.size else None,
        mean_interval=float(np.mean(intervals)) if some else None,
        median_interval=float(np.median(intervals)) if some else None,
        mean_speed=float(np.mean(speeds) / impact_velocity) if times.size else None,
    )
