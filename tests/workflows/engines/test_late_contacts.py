"""Test collisions with a late last contact, and ends that stay open."""

from dataclasses import replace

import numpy as np
import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.fixed_steps import with_doubts
from chaincor.workflows.collision import collide
from chaincor.workflows.engines import end_watch
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.reference import look_ahead, stepping
from chaincor.workflows.engines.reference.look_ahead import LookAhead
from chaincor.workflows.engines.reference.moving import Motion
from chaincor.workflows.showing.text import describe_result

# Three integrators that share no code with the engines gave these values. All digits are certain.
LATE = {
    28: (1.47, 27, 38.808724, 0.80498439256),
    25: (1.45, 24, 34.812703, 0.80185364884),
    117: (1.36, 111, 213.994813, 0.76958001963),
}


def check(engine, particles, tolerance, endings=("proved", "argued")):
    speed, contacts, last, restitution = LATE[particles]
    result = collide(
        Scene(potential="lj", particles=particles, speed=speed, engine=engine), tolerance=tolerance
    )
    assert result.contacts == contacts
    assert result.ending in endings
    # The error bar would include a late contact of slightly different motions.
    assert result.tolerance_met == (result.ending != "open")
    # The known value is rounded by half a unit of the last digit.
    assert abs(result.restitution - restitution) <= result.restitution_error + 5e-12
    assert f"end                    {result.ending}: " in describe_result(result)
    # In such a sensitive collision, errors of times are up to a thousand times that of eta.
    assert result.last_contact_time == pytest.approx(last, abs=1e3 * tolerance)


@pytest.mark.parametrize("engine", ["reference", "lammps"])
@pytest.mark.parametrize("particles", [25, 28])
def test_late_contacts_are_found(engine, particles):
    check(engine, particles, 1e-7)


@pytest.mark.slow
def test_late_contacts_of_a_long_chain_are_found():
    # The last digits decide whether a further contact follows after thousands of time units.
    check("reference", 117, 1e-6, ("argued", "open"))


# Another integrator computed twelve motions of each chain with errors of 1e-9. Of these, this many
# hit the wall once more than the engine's run, hundreds of time units after its last contact.
CHAOTIC = {(157, 1.4869): 10, (48, 1.3505): 4, (77, 1.4979): 3}


@pytest.mark.slow
@pytest.mark.parametrize(("particles", "speed"), CHAOTIC)
def test_what_the_last_digits_decide_is_in_the_bar(particles, speed):
    scene = Scene(potential="lj", particles=particles, speed=speed, engine="reference")
    result = collide(scene, tolerance=1e-6)
    # A further contact changes the momentum by some 0.1, and eta by at least 1e-3.
    assert result.ending == "open"
    assert result.error_parts.ending > 1e-3
    assert result.tolerance_met is False


def test_a_contact_that_only_the_run_itself_misses_is_in_the_bar(monkeypatch):
    monkeypatch.setattr(LookAhead, "_follow_again", lambda *_: 0.1)
    scene = Scene(potential="lj", particles=48, speed=1.3505)
    found = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.05))
    assert found.ending.kind == "open"
    assert found.ending.missed_momentum >= 0.1


def test_other_motions_are_followed_only_if_a_return_is_not_unlikely(monkeypatch):
    # Soon after the last contact, the estimated risk of a return is 0.013 in the first scene and 1
    # in the second.
    numerics, follow_again = Numerics(scheme="order8", timestep=0.1), LookAhead._follow_again
    for particles, speed, alone in ((100, 0.8, True), (48, 1.3505, False)):
        scene = Scene(potential="lj", particles=particles, speed=speed)
        again: list[float] = []

        def follow(look, share, *times, again=again):
            again.append(share)
            return follow_again(look, share, *times)

        with monkeypatch.context() as patch:
            patch.setattr(LookAhead, "_follow_again", follow)
            found = stepping.run(scene.problem, numerics)
            assert (again == []) == alone
            patch.setattr(look_ahead, "RISK_AT_STAKE", -1.0)
            several = stepping.run(scene.problem, numerics)
        assert len(again) >= 4
        assert found.ending.kind == several.ending.kind
        assert np.array_equal(found.velocities, several.velocities)


def test_a_long_broken_chain_is_followed_again_from_its_last_contact(monkeypatch):
    # The chain of the test above is treated as a long chain. If it were followed again from its
    # first contact, its motion would differ.
    scene = Scene(potential="lj", particles=48, speed=1.3505)
    numerics = Numerics(scheme="order8", timestep=0.05)
    whole = stepping.run(scene.problem, numerics)
    begun = []
    after = Motion.after_last_contact
    monkeypatch.setattr(Motion, "after_last_contact", lambda self: begun.append(1) or after(self))
    monkeypatch.setattr(look_ahead, "_MOST_SAMPLED", 47)
    found = stepping.run(scene.problem, numerics)
    assert begun == [1]
    assert np.array_equal(found.contact_times, whole.contact_times)
    assert found.ending.kind != "proved"


def test_one_that_takes_all_cores_is_not_followed_again(monkeypatch):
    scene = Scene(potential="lj", particles=48, speed=1.3505)
    numerics = Numerics(scheme="order8", timestep=0.05)
    whole = stepping.run(scene.problem, numerics)
    monkeypatch.setattr(look_ahead, "LEAST_ACTIVE", 47)
    monkeypatch.setattr(LookAhead, "_follow_again", lambda *_: pytest.fail("it was"))
    found = stepping.run(scene.problem, numerics)
    assert found.ending.kind == "argued"
    assert found.duration > whole.contact_times[-1] + sound_round_trip(48, 1.0)
    assert np.array_equal(found.contact_times, whole.contact_times)


@pytest.mark.slow
def test_what_comes_after_a_long_silence_amplifies_rounding():
    # The last contact comes at t = 1253, long after the other contacts. Decreasing steps of order 4
    # give an eta between 0.781748 and 0.781753, depending on rounding.
    scene = Scene(potential="lj", particles=106, speed=1.4236556803982834, engine="reference")
    result = collide(scene, tolerance=1e-6)
    assert result.ending == "open" or result.error_parts.rounding > 1e-6


def test_contacts_of_only_one_of_two_runs_are_in_doubt():
    scene = Scene(potential="lj", particles=28, speed=1.47, engine="reference")
    whole = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.03))
    cut = replace(
        whole,
        contact_times=whole.contact_times[:-1],
        contact_speeds=whole.contact_speeds[:-1],
    )
    doubted = with_doubts(cut, [whole])
    assert doubted.ending.kind == "open"
    assert doubted.ending.missed_momentum == 2.0 * whole.contact_speeds[-1]
    assert with_doubts(whole, [whole]).ending == whole.ending
    # A contact in the middle of the collision that only one of two runs has does not affect the
    # end.
    times, speeds = (np.delete(each, 5) for each in (whole.contact_times, whole.contact_speeds))
    without = replace(whole, contact_times=times, contact_speeds=speeds)
    assert with_doubts(whole, [without]).ending == whole.ending
    assert with_doubts(without, [whole]).ending == whole.ending
    assert with_doubts(without, [cut]).ending == doubted.ending


@pytest.mark.slow
def test_a_graze_of_a_long_chain_is_no_late_contact():
    # The run at twice the step lacks one of 1711 contacts, long before the last. A run with a
    # hundredth of the tolerance also has 1711 contacts.
    result = collide(Scene(particles=2000, engine="reference"))
    assert result.tolerance_met
    assert result.contacts == 1711
    assert abs(result.restitution - 0.77568305) <= result.restitution_error + 2e-8


def test_an_open_end_widens_the_bar_and_says_so(monkeypatch):
    # The first piece approaches until t = 34.6 and hits the wall at t = 38.8. Here, the engine
    # gives up at t = 34.37, a time of 2.87 after contact 26. The interval between contacts 25 and
    # 26 is 2.77.
    scene = Scene(potential="lj", particles=28, speed=1.47, engine="reference")
    monkeypatch.setattr(end_watch, "ARRIVAL_CROSSINGS", 0.0)
    monkeypatch.setattr(end_watch, "FOLLOWED_TIMES", 1.0)
    monkeypatch.setattr(end_watch, "LEAST_CROSSINGS", 2.87 / (28 + 5))
    result = collide(scene, tolerance=1e-7)
    assert result.contacts == 26
    assert result.ending == "open"
    assert result.error_parts.ending > 1e-3
    assert result.tolerance_met is False
    assert "a piece of the broken chain may still hit the wall" in result.reason
    # The error bar includes the effect of the contact that the engine did not wait for.
    assert 1e-2 < abs(result.restitution - LATE[28][3]) <= result.restitution_error
    said = describe_result(result)
    assert "end                    open: another contact may still come; the error bar" in said
