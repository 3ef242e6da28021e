import numpy as np
import pytest

from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.dumps.run_commands import RunCommands
from chaincor.analysis.job_analysis import infer_timestep


@pytest.mark.parametrize(
    ("log", "script", "expected"),
    [
        (None, "units lj\ntimestep 0.005\nrun 10\n", 0.005),
        (None, "timestep ${h}\n", None),
        (None, "timestep 0.01\nrun 5\ntimestep 0.02\n", None),
        (None, "# timestep 0.01\n", None),
        # A text that a script prints may begin with the name of a command.
        ("timestep ... of all runs\ntimestep 0.0.1\n", "timestep 0.1\n", None),
        ("timestep ${h}\ntimestep 2e-3\n", "timestep ${h}\n", 0.002),
        # The number of composed steps does not give the time.
        ("timestep 0.1\ntimestep -0.05\n", "timestep 0.1\n", None),
    ],
)
def test_timestep_command(tmp_path, log, script, expected):
    files = []
    for name, text in (("log", log), ("in", script)):
        path = tmp_path / name
        if text is not None:
            path.write_text(text)
        files.append([path] if text is not None else [])
    assert RunCommands.read(*files).timestep == expected


@pytest.mark.parametrize(("fmt", "error"), [("%.17g", 1e-6), ("%g", 2e-4)])
def test_flight_of_the_last_particle_tells_the_timestep(harmonic20, dump_writer, fmt, error):
    times = np.arange(-5.0, 40.0, 0.5)
    path = dump_writer.write(harmonic20, times, columns="id x vx", fmt=fmt, timestep=0.005)
    dump = Dump(path)
    layout = ChainLayout.from_frame(dump.first())
    # The flight counts as free until the speed has changed by 1e-5, late in a flight of 20. With
    # %g, positions have an error of 5e-5 at the start and at the end of a flight over v0 * 20 = 2.
    assert infer_timestep(dump, layout) == pytest.approx(0.005, rel=error)


def test_no_flight_no_timestep(harmonic20, dump_writer):
    dump = Dump(dump_writer.write(harmonic20, np.arange(25.0, 30.0, 0.5), columns="id x vx"))
    layout = ChainLayout.from_frame(dump.first())
    short = Dump(dump_writer.write(harmonic20, [0.0], name="one", columns="id x vx"))
    assert infer_timestep(short, layout) is None
