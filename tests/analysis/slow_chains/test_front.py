import math

import pytest

from benchmarks.slow_chains.spectral import spectral_minima
from chaincor.analysis.slow_chains.front import front_loss
from chaincor.analysis.theory import harmonic_dissipation_limit


def test_a_front_that_does_not_steepen_is_airys():
    found = front_loss(0.0)
    assert found.error < 1e-5
    assert found.loss == pytest.approx(harmonic_dissipation_limit(), abs=found.error)


@pytest.mark.parametrize(("variable", "order"), [(1.0, 3), (1.0, 4), (1.0, 5), (-3.0, 3)])
def test_grids_agree_within_their_errors(variable, order):
    rough, fine = (front_loss(variable, order, refinement) for refinement in (0.7, 1.0))
    assert fine.error < rough.error < 1e-3
    assert abs(rough.loss - fine.loss) <= rough.error + fine.error
    # Steepening increases the loss, and softening decreases it, by at least a tenth at y = 1.
    assert math.copysign(1.0, variable) * (fine.loss - harmonic_dissipation_limit()) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize(("variable", "order"), [(3.0, 3), (13.0, 3), (2.0, 4)])
def test_a_second_method_agrees(variable, order):
    front = front_loss(variable, order, 0.7)
    _, loss, error = spectral_minima(variable, order)[0]
    assert error < 2e-3
    assert abs(front.loss - loss) <= front.error + error


@pytest.mark.slow
def test_another_wave_takes_over_between_18_and_19():
    earlier, later = (front_loss(variable, 3, 0.5).minima[:2] for variable in (18.0, 19.0))
    # At y = 18, the deepest minimum is ahead of the second deepest; at y = 19, behind it.
    assert earlier[0].place > earlier[1].place + 3.0
    assert later[0].place < later[1].place - 3.0


@pytest.mark.parametrize(("variable", "order"), [(math.inf, 3), (math.nan, 3), (1.0, 6), (1.0, 2)])
def test_what_has_no_curve_is_refused(variable, order):
    with pytest.raises(ValueError, match="Give a finite variable and order 3 to 5"):
        front_loss(variable, order)
