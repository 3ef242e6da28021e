import numpy as np
import pytest

from chaincor.analysis.collision_frames import Known
from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.analysis.modes import mode_energies
from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.bonds.exponential_bonds import Toda
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError

ETA20 = 0.86850360724  # reference_values.json
TIMES = np.arange(0.0, 90.0, 1.0)


def analyze(path, **known):
    return analyze_frames(Dump(path), Known(**known))


def has_caveat(analysis, words):
    return any(words in caveat for caveat in analysis.caveats)


def test_a_perfect_dump_gives_all_digits(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES)
    analysis = analyze(path, bond=Harmonic(), end_argument=lambda *_: "proved")
    u, v = harmonic20.state(TIMES[-1])
    assert analysis.restitution == float(restitution(v, analysis.velocity))
    assert analysis.restitution == pytest.approx(ETA20, abs=1e-11)
    # A single run does not show the error of its time step.
    assert analysis.restitution_error is None
    assert analysis.data_error < 1e-13
    np.testing.assert_array_equal(analysis.mode_energies, mode_energies(u, v))
    assert analysis.contacts == 17
    np.testing.assert_allclose(analysis.contact_times, harmonic20.contact_times, atol=1e-8)
    assert abs(analysis.energy_drift) < 1e-12
    assert 0.0 <= analysis.momentum_residual < 1e-8
    assert analysis.caveats == ()
    assert analysis.timestep is None
    assert (analysis.frames, analysis.time_start, analysis.time_end) == (90, 0.0, 89.0)


def test_default_format_costs_the_digits_it_says(harmonic20, dump_writer):
    times = np.arange(-5.0, 90.0, 0.5)
    path = dump_writer.write(harmonic20, times, columns="id x vx", fmt="%g", shuffle=True)
    for bond in (None, Harmonic()):
        analysis = analyze(path, bond=bond, timestep=0.005)
        assert abs(analysis.restitution - ETA20) <= analysis.data_error
        # With six digits of v0 and of a mean speed near v0, the error is 2 e (5e-7 + e 5e-7)/0.1.
        assert analysis.data_error < 2e-5
        assert analysis.contacts == 17
        assert has_caveat(analysis, "velocities are printed to 5e-06 of the impact speed")
        assert has_caveat(analysis, "displacements are taken from column x, good to 5e-05")
        assert analysis.time_start == pytest.approx(-5.0, abs=1e-3)


@pytest.mark.parametrize("after_turn", [True, False])
def test_a_dump_may_start_on_either_side_of_the_first_turn(harmonic20, dump_writer, after_turn):
    path = dump_writer.write(harmonic20, TIMES)
    if not after_turn:
        text = path.read_text()
        path.write_text(
            text.replace("\n1 0 0.10000000000000001 ", "\n1 0 -0.10000000000000001 ", 1)
        )
    analysis = analyze(path, bond=Harmonic())
    assert analysis.contacts == 17
    assert analysis.contact_times[0] == 0.0


def test_impact_speed_of_the_scene_wins_if_the_dump_agrees(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, fmt="%.4g")
    given = 0.1 * (1.0 + 1e-6)
    assert analyze(path, impact_velocity=given).velocity == given
    with pytest.raises(InputError, match=r"impact speed 0\.1, but the scene has 0\.11"):
        analyze(path, impact_velocity=0.11)


def test_a_late_start_needs_the_impact_speed(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES[10:])
    with pytest.raises(InputError, match=r"the impact speed is unknown.*--velocity"):
        analyze(path, bond=Harmonic())
    analysis = analyze(path, bond=Harmonic(), impact_velocity=0.1)
    assert analysis.restitution == pytest.approx(ETA20, abs=1e-11)
    assert analysis.contacts is None
    assert has_caveat(analysis, "inside the collision")


def test_an_early_end_is_said(harmonic20, dump_writer):
    cut = analyze(dump_writer.write(harmonic20, TIMES[:10]), bond=Harmonic())
    assert has_caveat(cut, "still moves towards the wall")
    short = analyze(dump_writer.write(harmonic20, TIMES[:50]), bond=Harmonic())
    assert has_caveat(short, "a later contact cannot be ruled out")
    argued = analyze(
        dump_writer.write(harmonic20, TIMES[:50]), bond=Harmonic(), end_argument=lambda *_: "proved"
    )
    assert argued.ending == "proved"
    assert not has_caveat(argued, "ruled out")
    unlikely = analyze(
        dump_writer.write(harmonic20, TIMES[:50]), bond=Harmonic(), end_argument=lambda *_: "argued"
    )
    assert has_caveat(unlikely, "does not rule out a contact after the last frame")
    # In a chain of 20 particles, sound returns after a time of 40. The last contact is before t =
    # 50, and the frames end at t = 120.
    long = analyze(dump_writer.write(harmonic20, TIMES), bond=Harmonic())
    assert has_caveat(long, "nothing else shows that no later contact follows")


def test_different_frames_of_one_step_are_refused(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, time_item=True, columns="id x vx")
    first, second, *others = path.read_text().split("ITEM: TIME\n")[1:]
    head, rows = first.partition("ITEM: ATOMS")[0], second.partition("ITEM: ATOMS")[2]

    def write(*frames):
        path.write_text("".join(f"ITEM: TIME\n{frame}" for frame in frames))

    write(first, first, second, *others)
    assert analyze(path, bond=Harmonic()).contacts == 17
    write(first, f"{head}ITEM: ATOMS{rows}", second, *others)
    with pytest.raises(InputError, match="two frames of step 0 have different positions"):
        analyze(path, bond=Harmonic())


def test_a_bond_that_does_not_fit_makes_contact_times_uncertain(harmonic20, dump_writer):
    # A Toda bond of b = 0.1 is nearly a spring: the contacts are found, the momentum differs.
    analysis = analyze(dump_writer.write(harmonic20, TIMES), bond=Toda(0.1))
    assert analysis.contacts == 17
    assert has_caveat(analysis, "differs from the momentum in the dump by up to 4.7e-03 v0")


def test_a_cut_frame_is_said(harmonic20, dump_writer):
    analysis = analyze(dump_writer.write(harmonic20, TIMES, cut=100), bond=Harmonic())
    assert analysis.restitution == pytest.approx(ETA20, abs=1e-11)
    assert analysis.frames == len(TIMES) - 1
    assert has_caveat(analysis, "incomplete and was left out")


def test_frames_too_far_apart_leave_contacts_open(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, np.arange(0.0, 100.0, 6.0))
    analysis = analyze(path)
    assert analysis.contacts is None
    assert has_caveat(analysis, "number of contacts is unknown")
    assert has_caveat(analysis, "--potential")
    assert analysis.restitution == pytest.approx(ETA20, abs=1e-11)
    assert analyze(path, bond=Harmonic()).contacts == 17


def test_reversed_ids_are_said(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, columns="id x vx", reverse_ids=True)
    analysis = analyze(path, bond=Harmonic(), timestep=0.005)
    assert analysis.contacts == 17
    assert has_caveat(analysis, "ids do not count particles from the wall")


def test_no_contact_no_time_no_order_are_errors(harmonic20, dump_writer):
    with pytest.raises(InputError, match="no contact with the wall"):
        analyze(dump_writer.write(harmonic20, np.arange(-9.0, -2.0, 1.0)))
    with pytest.raises(InputError, match="--timestep"):
        analyze(dump_writer.write(harmonic20, TIMES, columns="id x vx"))
    with pytest.raises(InputError, match="earlier than the one before"):
        analyze(dump_writer.write(harmonic20, [0.0, 2.0, 1.0]))
    for name in ("impact_velocity", "timestep"):
        with pytest.raises(InputError, match=r"is nan\. Give a positive finite number"):
            analyze(dump_writer.write(harmonic20, TIMES), **{name: np.nan})


def test_history_is_bounded_and_reaches_the_end(harmonic20, dump_writer):
    times = np.arange(0.0, 90.0, 0.1)
    history = analyze(dump_writer.write(harmonic20, times)).history
    assert len(history.times) <= 601
    assert history.times[-1] == pytest.approx(times[-1])
    assert len(history.series_times) == len(times)
    n_energy = 0.5 * history.momentum**2 / 20
    np.testing.assert_allclose(history.translation, n_energy)
    u = history.displacements
    assert history.bond_min.min() <= 1.0 + np.diff(u, axis=1).min()


def test_a_single_particle_bounces_perfectly(bounce):
    analysis = analyze(bounce(0.1), timestep=1.0)
    assert analysis.restitution == 1.0
    assert analysis.contacts == 1
    assert analysis.mode_energies.shape == (1,)
