"""The words of a result, each explained in a sentence."""

TERMS = {
    "v*": "speed scale of a potential: the kinetic energy of a particle at v* compresses a bond to "
    "where it stores twice what a spring would",
    "restitution (energy)": "eta = K_r/K_i, final over initial kinetic energy of the centre of "
    "mass (with a free target: of the relative motion); after +- how far it may be from the exact "
    "number",
    "restitution (speed)": "e = sqrt(eta), final over initial speed of the centre of mass; most "
    "other texts mean this one",
    "contacts": "how often particle 1 meets the wall or the target; times t count from the first "
    "contact, in units of sqrt(mass/stiffness)",
    "end": "how sure it is that no further contact comes: proved by energy and momentum, argued, "
    "or open",
    "chain": "the centre of mass after the collision, its kinetic energy (translation), and all "
    "other energy (vibration)",
    "target": "the same of the free target",
    "bond lengths": "shortest and longest bond during the collision; 1 at rest",
    "energy drift": "(E_end - E_start)/E_start; exact motion has none",
    "momentum residual": "momentum at the end that the contacts do not explain, in units of that "
    "at impact; exact motion has none",
    "fragments": "pieces the chain is in: across a broken bond there is more relative energy than "
    "it takes to part",
    "crossed": "harmonic bonds let particles pass through each other, which atoms do not",
    "run by": "engine (lammps, or reference: the in-house one); how the contact is met (event "
    "wall: located within a step; reflect wall: stock fix wall/reflect); the scheme that "
    "integrates; H, its time step",
    "time": "wall-clock time of the run that gave the number, and of everything: scouting, tables, "
    "runs for the error bar",
}


# What people look a term up by.
_ALSO = {
    "restitution (energy)": ("eta", "restitution", "error bar", "K_r/K_i"),
    "restitution (speed)": ("e", "kinematic restitution"),
    "end": ("proved", "argued", "open", "ending"),
    "contacts": ("t", "last contact", "hits"),
    "v*": ("v_star", "speed", "u"),
    "run by": ("engine", "wall", "scheme", "H", "event", "reflect", "reference", "lammps", "table"),
    "chain": ("translation", "vibration"),
    "fragments": ("broken",),
}


def other_names() -> dict[str, str]:
    """Return other words for the terms, and the term of each."""
    return {word: term for term, words in _ALSO.items() for word in words}
