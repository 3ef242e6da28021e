"""
Splittings with kicks of their own: drifts a_k H and kicks b_k H that make up no Verlet steps.

They hold where forces depend on positions alone and the kinetic energy is quadratic, as they do
here (Runge, Kutta and Nystrom's kind). LAMMPS cannot take them: its Verlet steps tie each kick to
the drifts beside it.
"""

# Blanes and Moan (2002), J. Comput. Appl. Math. 142, 313, table 3: order 6, fourteen stages,
# beginning with a drift. First halves; what is left of 1 makes the middle drift and the two kicks
# beside it.
_DRIFTS = (
    0.0378593198406116,
    0.102635633102435,
    -0.0258678882665587,
    0.314241403071447,
    -0.130144459517415,
    0.106417700369543,
    -0.00879424312851058,
)
_KICKS = (
    0.09171915262446165,
    0.183983170005006,
    -0.05653436583288827,
    0.004914688774712854,
    0.143761127168358,
    0.328567693746804,
)
_HALF = (*_KICKS, 0.5 - sum(_KICKS))
SRKN14_ORDER = 6
SRKN14_DRIFTS = (*_DRIFTS, 1.0 - 2.0 * sum(_DRIFTS), *reversed(_DRIFTS))
SRKN14_KICKS = (*_HALF, *reversed(_HALF))
