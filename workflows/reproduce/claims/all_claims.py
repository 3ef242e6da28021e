"""The claims of the paper, in its order: one table, nothing hidden."""

from chaincor.workflows.reproduce.claims.harmonic_chains import HARMONIC_CLAIMS
from chaincor.workflows.reproduce.claims.nonlinear_chains import NONLINEAR_CLAIMS

RULES = HARMONIC_CLAIMS + NONLINEAR_CLAIMS
