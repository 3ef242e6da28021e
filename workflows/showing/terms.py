"""The words of a result, each explained in a sentence."""

TERMS = {
    "v*": "unit of speed that tells how little a bond acts as a spring: the kinetic energy of one "
    "particle at v* compresses the bond so far that it stores twice the energy of a spring of the "
    "same stiffness, compressed as far",
    "restitution (energy)": "eta = K_r/K_i, final over initial kinetic energy of the centre of "
    "mass (with a free target: of the relative motion); +- says how far eta may be from the exact "
    "number",
    "restitution (speed)": "e = sqrt(eta), final over initial speed of the centre of mass; most "
    "other texts mean this one",
    "contacts": "how often particle 1 meets the wall or the target; times t count from the first "
    "contact, in units of sqrt(mass/stiffness)",
    "end": "how sure it is that no further contact comes: proved (energy and momentum rule it "
    "out), argued (it is very unlikely), or open (another contact may still come; the error bar "
    "allows for it)",
    "chain": "velocity of its centre of mass after the collision, or in a dump's last frame; "
    "energy of translation: the kinetic energy of that motion; of vibration: all its other energy",
    "target": "the same of the free target",
    "bond lengths": "shortest and longest bond from the first contact to the last, 1 at rest; "
    "+- says how much farther they may have gone between two steps",
    "energy drift": "(E_end - E_start)/E_start of the total energy E; 0 for exact motion",
    "momentum residual": "momentum at the end that the contacts do not explain, as a share of the "
    "initial momentum, which is n v0 for unit masses; 0 for exact motion",
    "fragments": "number of pieces of the chain; a bond is broken where the two sides move apart "
    "with more energy than the bond can hold",
    "crossed": "particles passed through each other in this collision, as the formula of its bonds "
    "allows; atoms cannot",
    "run by": "engine (lammps, or reference: the in-house one); how the contact is met (event "
    "wall: located within a step; reflect wall: stock fix wall/reflect); the scheme that "
    "integrates; H, its time step",
    "time": "wall-clock time of the run that gave the number, and that of everything: set-up, "
    "tables, runs for the error bar",
}

OF_DUMPS = {
    "frames": "states of all particles that the dump holds; the motion between two frames is "
    "computed from both",
    "format and reading": "error of eta that the dump's limited digits and frames cause; the error "
    "of the run itself (steps, table, wall) is not in it",
    "f/n": "contacts per particle of the chain; 1 for hard balls, about 0.87 for long chains of "
    "springs",
    "interval": "time from one contact to the next, in units of sqrt(mass/stiffness)",
    "incoming speed": "speed of particle 1 just before a contact, in units of v0, the speed of the "
    "chain before its first contact",
    "vibration": "share of the energy in the last frame that is not translation of the chain; in "
    "the row chain it is an energy",
    "anharmonic remainder": "energy of the bonds in the last frame that is in no mode: modes are "
    "exact for springs alone",
    "strongest modes": "the three vibrations with most energy in the last frame, and their shares "
    "of the energy of all modes; j = 1 has the longest wave, of two chain lengths",
    "strongest at first": "the strongest modes in the first frame, if the chain vibrated then",
    "note": "what limits the numbers above; where a note calls something impossible, trust none of "
    "the numbers: the exit status is then 1",
}

OF_STUDIES = {
    "setting": "engine, wall, scheme, table and H, the time step, together",
    "kept": "a limit that the error of eta should not exceed in this and in similar scenes: the "
    "largest error measured at this step and smaller ones, times a safety factor",
    "cause wall": "difference of eta between LAMMPS's own wall and contacts located within the "
    "step, at the same steps",
    "cause integrator": "error of eta that the time step alone causes, with exact bonds, exact "
    "contacts and no rounding",
    "cause table": "difference of eta between tabulated and exact bonds, at the same steps",
    "cause rounding": "difference of eta between double precision and more digits, at the same "
    "steps",
    "cause output": "error of eta if it is computed from a default dump, which has six digits; "
    "the total does not contain it",
    "median, rms, worst": "of the absolute error of eta, over steps that differ by a "
    "few per cent: where the three are far apart, the error of a single run is a matter of luck",
}

OF_SCRIPTS = {
    "rung": "a few runs at nearby values of the variable, such as the time step; a ladder is a row "
    "of rungs from coarse to fine",
    "regular": "the error is a smooth power of the step: the value can be extrapolated",
    "irregular": "the number jumps about between nearby steps; the jumps shrink with the step",
    "noise": "the number jumps about as much at fine steps as at coarse ones: only the mean of "
    "more runs helps",
    "bounded": "the runs do not decide between regular, irregular and noise; no order is given, "
    "only a bound on the error, from the means over each rung",
    "cannot tell": "the number has the same digits in all runs",
    "order": "the power of the step with which the error, or its scatter, falls; +- is its "
    "uncertainty, at 95 % confidence",
    "scatter": "standard deviation of the number over the runs of a rung",
    "promises": "an error that a single run on this rung should not exceed",
}

ALL_TERMS = TERMS | OF_DUMPS | OF_STUDIES | OF_SCRIPTS


# What people look a term up by.
_ALSO = {
    "restitution (energy)": ("eta", "restitution", "error bar", "K_r/K_i"),
    "restitution (speed)": ("e", "kinematic restitution"),
    "end": ("proved", "argued", "open", "ending"),
    "contacts": ("t", "last contact", "hits"),
    "v*": ("v_star", "speed", "u"),
    "run by": (
        *("engine", "wall", "scheme", "H", "event", "reflect", "reference", "lammps", "table"),
        *("event wall", "reflect wall"),
    ),
    "chain": ("translation",),
    "momentum residual": ("momentum", "residual", "n v0", "initial momentum"),
    "fragments": ("broken",),
    "format and reading": ("data error",),
    "strongest modes": ("modes", "j"),
    "note": ("notes", "caveats"),
    "cause integrator": ("integrator",),
    "cause table": ("cause",),
    "cause rounding": ("rounding",),
    "cause output": ("output",),
    "median, rms, worst": ("median", "rms", "worst", "phases"),
    "order": ("verdict",),
    "promises": ("promised",),
}
# Each with its term.
OTHER_NAMES = {word: term for term, words in _ALSO.items() for word in words}
