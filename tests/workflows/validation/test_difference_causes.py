"""Test that mistakes made in the template of an integrator are named."""

import json

import pytest

ARGUMENTS = ("validate", "--potential", "lj", "--particles", "4", "--speed", "0.4")
MISTAKES = [
    ("masses=scene.line.chain_masses", "masses=np.ones(scene.particles)", "masses are ignored"),
    ("scene.impact_velocity", "scene.impact_velocity / scene.bond.natural_speed", "units of v*"),
    ("force=scene.bond.force", "force=lambda s: 72 * scene.bond.force(s)", "1 instead of 1/72"),
    ("force=scene.bond.force", "force=lambda s: -s", "the bonds are harmonic"),
    ('"velocities": v,', '"velocities": -v,', "still moves towards the wall"),
]


@pytest.fixture
def template(chaincor, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, text, _ = chaincor("validate", "--template")
    assert status == 0
    return text


@pytest.mark.slow
def test_the_template_agrees(template, chaincor, tmp_path):
    (tmp_path / "template_ok.py").write_text(template)
    words = (*ARGUMENTS, "--masses", "2,1", "--against", "template_ok:collide", "--json")
    status, out, _ = chaincor(*words)
    assert status == 0
    assert json.loads(out)["agrees"]


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(MISTAKES)))
def test_a_mistake_is_named(template, chaincor, tmp_path, number):
    right, wrong, said = MISTAKES[number]
    assert right in template
    # Each mistake has its own module, because modules are imported once.
    (tmp_path / f"mistake_{number}.py").write_text(template.replace(right, wrong))
    status, out, _ = chaincor(
        *ARGUMENTS, "--masses", "2,1", "--against", f"mistake_{number}:collide"
    )
    assert status == 1
    assert "note: likely cause: " in out
    assert said in out.partition("likely cause")[2]


@pytest.mark.slow
def test_a_coarse_step_is_named(template, chaincor, tmp_path):
    (tmp_path / "coarse.py").write_text(template)
    status, out, _ = chaincor(*ARGUMENTS, "--timestep", "0.05", "--against", "coarse:collide")
    assert status == 1
    assert "likely cause: the step. At 0.025 instead of 0.05" in out


@pytest.mark.slow
def test_no_cause_is_made_up(template, chaincor, tmp_path):
    """Name no cause for a force that is 3 % too large, which is not a listed mistake."""
    wrong = template.replace("scene.bond.force,", "lambda s: 1.03 * scene.bond.force(s),")
    (tmp_path / "unknown.py").write_text(wrong)
    status, out, _ = chaincor(*ARGUMENTS, "--against", "unknown:collide")
    assert status == 1
    assert "likely cause" not in out
