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
    "promises": "an error that a single run on this rung should not exceed",
}

ALL_TERMS = TERMS | TERMS_OF_DUMPS | OF_STUDIES | OF_SCRIPTS

# Other words that people look up.
_ALSO = {
    "cause integrator": ("integrator",),
    "cause table": ("cause",),
    "cause rounding": ("rounding",),
    "cause output": ("output",),
    "median, rms, worst": ("median", "rms", "worst", "phases"),
    "order": ("verdict",),
    "promises": ("promised",),
}
# The term of each other word.
OTHER_NAMES = OTHER_WORDS | {word: term for term, words in _ALSO.items() for word in words}
