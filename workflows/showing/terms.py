"""Define the words that commands print, each explained in a sentence."""

from chaincor.analysis.observables import OTHER_WORDS, TERMS, TERMS_OF_DUMPS

OF_STUDIES = {
    "setting": "engine, wall, scheme, bond table and time step H",
    "kept": "limit that the error of eta should not exceed in this scene and "
    "similar scenes: the largest error measured at this step and smaller "
    "steps, times a safety factor",
    "cause wall": "difference of eta between LAMMPS's own wall and contacts located within the "
    "step, at the same steps",
    "cause integrator": "error of eta that the time step alone causes, with exact bonds, exact "
    "contacts and no rounding",
    "cause table": "difference of eta between tabulated and exact bonds, at the same steps",
    "cause rounding": "difference of eta between double precision and more digits, at the same "
    "steps",
    "cause output": "error of eta if it is computed from a default dump, which has six digits; "
    "the total error does not include this part",
    "median, rms, worst": "statistics of the absolute error of eta over steps that differ by a "
    "few per cent. If the three values differ much, the error of a single run cannot be "
    "predicted",
}

OF_SCRIPTS = {
    "rung": "a few runs at nearly the same value of the varied quantity, such as "
    "the time step. A ladder is a sequence of rungs from coarse to fine",
    "regular": "the error is a smooth power of the step; the value can be extrapolated to small "
    "steps",
    "irregular": "the result jumps between nearby steps, and the jumps shrink with the step",
    "noise": "the result scatters as much at small steps as at large steps; only the mean of more "
    "runs is more accurate",
    "bounded": "the runs do not show whether the error is regular, irregular or noise. The means "
    "of the rungs give a bound on the error, but no order",
    "cannot tell": "the result has the same digits in all runs, which therefore do not show the "
    "error",
    "order": "power of the step to which the error, or the scatter, is proportional; +- is the 95 "
    "% uncertainty of the power",
    "scatter": "standard deviation of the quantity over the runs of a rung",
    "quantity": "result that the study reads from each run: mean, last value, drift or "
    "fluctuation of a "
    "thermo keyword, or a number that the script prints",
    "value": "best estimate of a quantity, for very small time steps or for the fine end of the "
    "ladder; +- is its 95 % error",
    "error": "in `timestep`, the largest difference of one run from the value, with "
    "95 % probability; in `table`, the largest error of LAMMPS's force as "
    "a fraction of the local force",
    "tolerance": "the error that you allow",
    "your 0.005": "whether one run at the script's own step (here 0.005) meets the tolerance: "
    "small enough, too large, mean of some runs, not judged or constant",
    "one run up to": "the coarsest value of the varied quantity at which the error of one run is "
    "within the tolerance",
    "not judged": "the runs show no effect of the step, but their scatter would hide an "
    "error as small as the tolerance",
    "one run": "standard error of one run's mean, from its own samples",
    "advice": "the cheapest way to meet the tolerance of this quantity, without regard to other "
    "quantities",
    "mean": "mean of the quantity over all runs at one value of the varied quantity",
    "time": "processor time of one run",
    "note": "a remark that changes no verdict",
    "caution": "a command of the script counts steps; the motion therefore depends on the time "
    "step",
    "numbering": "whether LAMMPS numbered the particles differently in the compared runs; they "
    "are then matched by position",
    "cause": "the likeliest reason for a difference",
    "parted": "time at which the positions in two runs differ by a hundredth of the distance "
    "between neighbours",
    "growth": "rate at which the difference between two runs grows",
    "same": "two runs agree in all digits",
    "together": "two runs differ by rounding errors that do not grow",
    "chaos": "rounding errors grow until two runs differ in all frames; their means can still be "
    "compared",
    "at once": "two runs differ from the beginning by more than rounding errors",
}

OF_TABLES = {
    "rows": "number of rows of a table, its first and last length, and zeros of the force",
    "range": "the range of lengths or angles in which the table is checked",
    "core": "error of the force at lengths below the range",
    "styles": "number of rows that each style of LAMMPS needs to meet the tolerance",
    "fault": "a reason why a table is not good",
}

OF_VALIDATIONS = {
    "judged": "the integrator under test, and its eta",
    "by": "the integrator used for the check, and its eta",
    "difference": "largest absolute difference between the two results",
    "error bars": "sum of the error bars of the two results, which is the largest allowed "
    "difference",
    "verdict": "whether all compared quantities agree within their error bars; in `timestep`, the "
    "kind of error: regular, irregular, noise, bounded or cannot tell",
    "bond_min": "shortest and longest bond of the collision; `validate` compares both",
    "contact_times": "times of all contacts since the first, compared one by one",
    "velocities": "final velocities, compared particle by particle",
    "mode_energies": "energies of the normal modes after the collision",
}

ALL_TERMS = TERMS | TERMS_OF_DUMPS | OF_STUDIES | OF_SCRIPTS | OF_TABLES | OF_VALIDATIONS

# Users may also ask for these words. The words on the right are explained under the term on the
# left.
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
# For other words, this table gives the term under which they are explained.
OTHER_NAMES = OTHER_WORDS | {word: term for term, words in _ALSO.items() for word in words}
