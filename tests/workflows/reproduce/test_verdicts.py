"""Test that wrong physics or the stock wall makes verdicts fail."""

from dataclasses import replace
from functools import partial

import pytest

from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.workflows.campaign.work import collide_scenes
from chaincor.workflows.reproduce.claims import Verdict
from chaincor.workflows.reproduce.figures.agreement import examine_points
from chaincor.workflows.reproduce.measurements import Answer
from chaincor.workflows.reproduce.measuring import measure
from chaincor.workflows.reproduce.paper import CLAIMS, studies
from chaincor.workflows.reproduce.plan import QUICK
from chaincor.workflows.reproduce.report import verdict_row

SMALL = replace(
    QUICK,
    curve_particles=20,
    curve_speeds=(0.01, 0.4, 0.8, 2.0),
    harmonic_sizes=(30, 100),
    harmonic_far_sizes=(),
    harmonic_velocities=(0.01, 0.1),
    sizes=(10, 20),
    far_sizes={},
    increase_speeds={
        3: (0.002, 0.004, 0.01, 0.015, 0.02),
        4: (0.01, 0.014, 0.02, 0.03),
        5: (0.02, 0.03, 0.04, 0.05),
    },
    slope_sizes=(20,),
    slope_far_sizes=(),
    slope_speeds=(0.02, 0.05, 0.1),
    harmonic_longest=(100, 300),
    slow_sizes=(),
    pair_speeds=(0.001, 0.01, 0.03, 0.1),
)
# This plan has only slow collisions, because fast chains cross if the bond softens under
# compression.
SLOW = replace(
    SMALL,
    curve_speeds=(0.01,),
    sizes=(),
    increase_speeds=dict.fromkeys((3, 4, 5), (0.002, 0.0025, 0.003, 0.004)),
    increase_tolerances=dict.fromkeys((3, 4, 5), 1e-5),
)
# Even the small plan reproduces these claims, each from different points.
SOUND = {"independence of v0", "contact time", "alpha", "power r = 4", "power r = 5"}


def run_here(scenes, alter):
    """Run scenes one by one, because bonds may be Python objects, which a store cannot save."""
    answers = []
    for scene in map(alter, scenes):
        (found,) = collide_scenes([scene])
        if isinstance(found, Exception):
            answers.append(Answer({}, {}, f"{type(found).__name__}: {found}"))
        else:
            answers.append(Answer(found.to_dict(), found.arrays()))
    return answers


def verdicts(plan, alter=lambda scene: scene):
    """Judge the claims by a plan's scenes, each of which is changed before its run."""
    measured = measure(plan, studies(plan), partial(run_here, alter=alter))
    found = {claim.key: verdict_row(claim, claim.found(measured)) for claim in CLAIMS}
    return found, examine_points(measured)


def with_other_sign(scene):
    """Mirror the bond: U(-s) softens under compression instead of stiffening."""
    if scene.label == "harmonic":
        return scene
    bond = scene.bond
    mirrored = UserBond(
        lambda s: bond.energy(-s),
        lambda s: -bond.force(-s),
        name=f"mirrored {bond.name}",
        strain_min=-0.95,
        strain_max=0.95,
    )
    plain = dict.fromkeys(("toda_b", "power_order", "power_c", "speed"))
    # NumPy functions are slow, and the sign of alpha does not need the tolerance of 1e-10.
    return scene.replace(
        **plain,
        potential=mirrored,
        velocity=scene.impact_velocity,
        tolerance=max(scene.tolerance, 1e-7),
    )


def with_stock_wall(scene):
    if scene.engine != "lammps":
        return scene
    return scene.replace(tolerance=None, wall="reflect", timestep=0.05)


@pytest.fixture(scope="module")
def sound():
    return verdicts(SMALL)


@pytest.mark.slow
def test_sound_physics_is_not_red(sound):
    found, health = sound
    assert {key for key in SOUND if found[key]["verdict"] == Verdict.NOT_REPRODUCED} == set()
    # If the end of a broken chain is open, LAMMPS reports that it misses the tolerance.
    for_lammps = health["points"] - (health["alone"] - len(health["not_given"]))
    assert for_lammps - len(health["failures"]) - 2 <= health["by_lammps"] <= for_lammps


@pytest.mark.slow
def test_wrong_sign_of_the_potential_turns_verdicts_red():
    found, _ = verdicts(SLOW, with_other_sign)
    for key in ("alpha", "power r = 3", "simulated slope"):
        assert found[key]["verdict"] == Verdict.NOT_REPRODUCED, key
    # The interval becomes longer instead of shorter, so that alpha changes its sign.
    assert found["alpha"]["value"] == pytest.approx(-0.8098, abs=1e-3)


@pytest.mark.slow
def test_stock_wall_turns_verdicts_red():
    found, health = verdicts(SMALL, with_stock_wall)
    for key in ("independence of v0", "power r = 4", "power r = 5"):
        assert found[key]["verdict"] == Verdict.NOT_REPRODUCED, key
    assert health["disagreements"] > 0.5 * health["compared"] or health["largest_error"] > 1e-3
