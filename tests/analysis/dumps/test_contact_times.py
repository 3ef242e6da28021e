import numpy as np

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.contact_times import reintegrate_contacts
from chaincor.lammps_inputs.bonds.potentials import Harmonic


def test_reintegration_follows_only_what_can_reach_the_wall(harmonic500):
    u, v = harmonic500.state(2.0)
    times, speeds = reintegrate_contacts(ChainState(0, 2.0, u, v), 9.0, Harmonic(), [np.ones(500)])
    inside = (harmonic500.contact_times > 2.0) & (harmonic500.contact_times < 9.0)
    np.testing.assert_allclose(times, harmonic500.contact_times[inside], atol=1e-9)
    np.testing.assert_allclose(speeds, harmonic500.contact_speeds[inside], rtol=1e-8)
