"""The words that commands print, each explained in a sentence."""

from chaincor.analysis.observables import OTHER_WORDS, TERMS, TERMS_OF_DUMPS

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
    "quantity": "a number of each run: mean, last value, drift or fluctuation of a thermo keyword, "
    "or a number that the script prints",
    "value": "best value of a number: its result at very small timesteps or at the fine end; +- is "
    "its 95 % error",
    "error": "of `timestep`: the largest difference of one run from the value, with 95 % "
    "probability. Of `table`: the largest error of LAMMPS's force, as a part of the local force",
    "tolerance": "the error that you allow",
    "your 0.005": "whether one run at the script's own step, 0.005 here, keeps the tolerance: "
    "small enough, too large, a mean of some runs, not judged or constant",
    "one run up to": "the coarsest value at which one run keeps the tolerance",
    "not judged": "the runs show no effect of the step, but scatter too much to show an error as "
    "small as the tolerance",
    "one run": "standard error of one run's mean, from its own samples",
    "advice": "the cheapest way to keep the tolerance of this number alone",
    "mean": "mean of the number over the runs at one value",
    "time": "processor time of one run",
    "note": "a remark that changes no verdict",
    "caution": "a command that counts steps and so changes the motion with the step",
    "numbering": "whether LAMMPS gave the particles other ids; they are then matched by position",
    "cause": "the likeliest reason of a difference",
    "parted": "time after which two runs are a hundredth of a neighbour's distance apart",
    "growth": "rate at which the distance of two runs grows",
    "same": "two runs agree in all digits",
    "together": "two runs differ by roundings that do not grow",
    "chaos": "two runs part because roundings grow; their means can be compared, frames cannot",
    "at once": "two runs differ from the beginning, by more than roundings",
}

OF_TABLES = {
    "rows": "number of rows of a table, its first and last length, and zeros of the force",
    "range": "the lengths or angles for which a table is judged",
    "core": "error of the force below the range",
    "styles": "rows that each style of LAMMPS needs for the tolerance",
    "fault": "a reason why a table is not good",
}

OF_VALIDATIONS = {
    "judged": "the integrator that is checked, and its eta",
    "by": "the integrator that checks it, and its eta",
    "difference": "largest absolute difference of both results",
    "error bars": "sum of both error bars, the largest difference that is allowed",
    "verdict": "whether all judged quantities agree within their error bars; of `timestep`, the "
    "kind of an error: regular, irregular, noise, bounded or cannot tell",
    "bond_min": "shortest and longest bond of the collision, of which `validate` compares both",
    "contact_times": "times of all contacts since the first, compared one by one",
    "velocities": "final velocities, compared particle by particle",
    "mode_energies": "energies of the normal modes after the collision",
}

ALL_TERMS = TERMS | TERMS_OF_DUMPS | OF_STUDIES | OF_SCRIPTS | OF_TABLES | OF_VALIDATIONS

# Other words that people look up.
_ALSO = {
    "cause integrator": ("integrator",),
    "cause rounding": ("rounding",),
    "cause output": ("output",),
    "median, rms, worst": ("median", "rms", "worst", "phases"),
    "error": ("promises", "keeps"),
    "your 0.005": ("small enough", "too large", "constant"),
    "bond_min": ("bond_max",),
    "contact_times": ("contact_speeds",),
    "velocities": ("target_velocities",),
    "mode_energies": ("target_mode_energies",),
    "error bars": ("agrees", "differs"),
}
# The term of each other word.
OTHER_NAMES = OTHER_WORDS | {word: term for term, words in _ALSO.items() for word in words}
