import pytest

from chaincor.analysis.slow_chains.front import front_loss
from chaincor.analysis.theory import harmonic_dissipation_limit


def test_a_front_that_does_not_steepen_is_airys():
    found = front_loss(0.0)
    assert found.error < 1e-4
    assert found.loss == pytest.approx(harmonic_dissipation_limit(), abs=found.error)


@pytest.mark.parametrize("order", [3, 4])
def test_grids_agree_within_the_error_they_say(order):
    rough, fine = front_loss(1.0, order, refinement=0.7), front_loss(1.0, order)
    assert rough.error < 0.01
    assert abs(rough.loss - fine.loss) <= rough.error + fine.error
    # Steepening costs: a front that steepens loses more than Airy's at y = 1.
    assert fine.loss > harmonic_dissipation_limit() + 0.1


@pytest.mark.parametrize(("variable", "order"), [(-1.0, 3), (float("nan"), 3), (1.0, 6), (1.0, 2)])
def test_what_has_no_curve_is_refused(variable, order):
    with pytest.raises(ValueError, match="expected 0 or more, and 3 to 5"):
        front_loss(variable, order)
