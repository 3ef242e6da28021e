import hashlib
import json

import numpy as np
import pytest

from chaincor.analysis.observables import TERMS, TERMS_OF_DUMPS
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.scene import Scene
from tests.page_checks import check_file_list, read_page, words_of


def frame(step, time, x, v):
    rows = "\n".join(f"{i + 1} {a} {b} {time}" for i, (a, b) in enumerate(zip(x, v, strict=True)))
    return (
        f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(x)}\nITEM: BOX BOUNDS ff pp pp\n"
        f"-10 50\n-0.5 0.5\n-0.5 0.5\nITEM: ATOMS id x vx v_time\n{rows}\n"
    )


@pytest.fixture
def job(tmp_path):
    """Return a job with the exact collision of two particles with a harmonic bond: eta = 1."""
    v0, omega = 0.1, np.sqrt(2.0)
    frames = []
    for step, time in enumerate(np.arange(0.0, 12.0, 0.5)):
        last = np.pi / omega
        if time <= last:
            strain = -2.0 * v0 / omega * np.sin(omega * time)
            opening = -2.0 * v0 * np.cos(omega * time)
            x = (0.5 - 0.5 * (1.0 + strain), 0.5 + 0.5 * (1.0 + strain))
            v = (-0.5 * opening, 0.5 * opening)
        else:
            x, v = (v0 * (time - last), 1.0 + v0 * (time - last)), (v0, v0)
        frames.append(frame(step, float(time), [float(a) for a in x], [float(a) for a in v]))
    folder = tmp_path / "job"
    folder.mkdir()
    (folder / "dump.lammpstrj").write_text("".join(frames))
    return folder


def test_json_holds_what_is_promised(job, chaincor):
    status, out, err = chaincor("analyze", job, "--potential", "harmonic", "--json")
    assert (status, err) == (0, "")
    result = json.loads(out)
    assert result["restitution"] == pytest.approx(1.0, abs=1e-12)
    assert result["restitution_error"] is None
    assert result["data_error"] < 1e-8
    assert result["contacts"] == 2
    assert result["last_contact_time"] == pytest.approx(np.pi / np.sqrt(2.0), abs=1e-8)
    assert result["mode_energies"] == pytest.approx([0.01, 0.0], abs=1e-12)
    assert isinstance(result["caveats"], list)
    assert result["ending"] == "proved"


def test_text_labels_both_coefficients_and_notes_caveats(job, chaincor):
    status, out, _ = chaincor("analyze", job)
    assert status == 0
    assert "restitution (energy)   eta = " in out
    assert "restitution (speed)    e   = 1" in out
    assert "note: the bond is unknown" in out


def test_a_scene_in_the_folder_gives_bond_and_speed(job, chaincor):
    scene = Scene(potential="harmonic", particles=2, velocity=0.1)
    (job / "scene.toml").write_text(scene.to_toml())
    _, out, _ = chaincor("analyze", job, "--json")
    result = json.loads(out)
    assert (result["potential"], result["velocity"]) == (Harmonic.name, 0.1)
    (job / "scene.toml").write_text(scene.replace(particles=3).to_toml())
    status, _, err = chaincor("analyze", job, "--json")
    assert status == 2
    assert "has 2 particles" in err


@pytest.mark.slow
def test_output_holds_plots_tables_and_pictures(job, tmp_path, chaincor):
    out = tmp_path / "out"
    status, printed, _ = chaincor(
        "analyze", job, "--potential", "harmonic", "-o", out, "--xyz", out / "c.xyz"
    )
    assert status == 0
    assert printed.endswith(f"page: {out / 'analysis.html'}\n")
    written = {path.name for path in out.iterdir()}
    assert {"analysis.json", "arrays.npz", "modes.csv", "trajectories.png", "c.xyz"} <= written
    assert not any(name.startswith(".") for name in written)
    page = read_page(out / "analysis.html")
    check_file_list(page, out, beside={"analysis.html", "c.xyz"})
    reported = words_of(page)
    assert str(out / "c.xyz") in reported
    # The page has the numbers of the terminal, explanations, and every figure that was drawn.
    _, text, _ = chaincor("analyze", job, "--potential", "harmonic")
    lines = text.partition("\n\n")[2].partition("\n\n")[0].splitlines()
    assert len(lines) > 9
    for line in lines:
        assert f"<b>{line[:22].strip()}</b>" in page
        assert (TERMS | TERMS_OF_DUMPS)[line[:22].strip()]
    assert page.count("<figure ") == sum(name.endswith(".png") for name in written)
    assert hashlib.sha256((job / "dump.lammpstrj").read_bytes()).hexdigest() in page


@pytest.mark.slow
def test_a_page_has_the_results_in_the_units_of_the_dump(job, tmp_path, chaincor):
    # Doubling mass and stiffness changes the unit of energy, but not times and speeds.
    units = ["--length", "1", "--mass", "2", "--stiffness", "2"]
    bond = ["--potential", "harmonic", "--masses", "2"]
    status, printed, _ = chaincor("analyze", job, *bond, *units, "-o", tmp_path / "out")
    assert status == 0
    line = next(line for line in printed.splitlines() if line.startswith("in units lj: "))
    assert line in words_of(read_page(tmp_path / "out" / "analysis.html"))
    chaincor("analyze", job, "--potential", "harmonic", "-o", tmp_path / "plain")
    assert "in units lj" not in words_of(read_page(tmp_path / "plain" / "analysis.html"))


@pytest.mark.slow
def test_a_page_warns_of_what_is_impossible(job, tmp_path, chaincor):
    dump = job / "dump.lammpstrj"
    # The velocities in the last frames are twice those that energy conservation allows.
    head, *frames = dump.read_text().split("ITEM: TIMESTEP")
    fast = [frame.replace(" 0.1 ", " 0.2 ") for frame in frames[-16:]]
    dump.write_text("ITEM: TIMESTEP".join([head, *frames[:-16], *fast]))
    out = tmp_path / "out"
    status, *_ = chaincor("analyze", job, "--potential", "harmonic", "-o", out)
    assert status == 1
    assert "Contradicted." in words_of(read_page(out / "analysis.html"))


def test_a_scene_elsewhere_says_what_one_beside_the_dump_would(job, tmp_path, chaincor):
    scene = Scene(potential="harmonic", particles=2, velocity=0.1)
    (tmp_path / "mine.toml").write_text(scene.to_toml())
    status, out, err = chaincor("analyze", job, "--scene", tmp_path / "mine.toml", "--json")
    assert (status, err) == (0, "")
    assert json.loads(out)["potential"] == "harmonic"
    other = scene.replace(particles=3)
    (tmp_path / "mine.toml").write_text(other.to_toml())
    status, out, err = chaincor("analyze", job, "--scene", tmp_path / "mine.toml")
    assert (status, out) == (2, "")
    assert "has 2 particles" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--dump", "none"], "cannot read the dump none"),
        (["--data", "none"], "cannot read none"),
        (["--scene", "none"], "none does not exist"),
        (["--potential", "toda", "--toda-b", "-1"], "toda_b"),
        (["--toda-b", "3"], "without --potential"),
        (["--velocity", "0.2"], "the dump starts with the impact speed 0.1"),
        (["--timestep", "-1"], "--timestep"),
        (["--animation", "c.avi"], "Give a name that ends in .gif"),
    ],
)
def test_bad_input_is_one_line_and_status_2(job, chaincor, arguments, message):
    status, out, err = chaincor("analyze", job, *arguments)
    assert status == 2
    assert out == ""
    assert message in err
    assert err.count("\n") == 1


def test_what_contradicts_the_files_is_refused_or_said(job, chaincor):
    (job / "scene.toml").write_text('potential = "harmonic"\nparticles = 2\nvelocity = 0.1\n')
    status, out, _ = chaincor("analyze", job, "--potential", "toda")
    assert "energies are computed for toda bonds, as requested" in " ".join(out.split())
    dump = job / "dump.lammpstrj"
    dump.write_text(dump.read_text().replace("id x vx v_time", "id v_displacement vx v_time"))
    status, out, err = chaincor("analyze", job, "--wall", "3")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "Drop the options for another wall" in err


def test_a_folder_is_no_file_to_write(job, chaincor):
    status, _, err = chaincor("analyze", job, "--potential", "harmonic", "--xyz", job)
    assert (status, "because it is a folder" in err) == (2, True)


@pytest.mark.parametrize("option", ["--xyz", "--animation"])
def test_what_is_read_is_not_written_over(job, chaincor, option):
    dump = (job / "dump.lammpstrj").rename(job / "dump.gif")
    before = dump.read_bytes()
    status, out, err = chaincor("analyze", job, option, dump)
    assert (status, out, err.count("\n"), dump.read_bytes()) == (2, "", 1, before)
    assert "which is an input of this command" in err


@pytest.mark.parametrize(("option", "name"), [("--xyz", "notes.txt"), ("--animation", "a.gif")])
def test_files_of_another_kind_stay(job, chaincor, tmp_path, option, name):
    mine = tmp_path / name
    mine.write_text("my notes of\nProperties of chains")
    status, out, err = chaincor("analyze", job, option, mine)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "holds something else" in err
    assert mine.read_text().startswith("my notes")


def test_an_earlier_file_of_the_motion_is_replaced(job, chaincor, tmp_path):
    for _ in range(2):
        assert chaincor("analyze", job, "--xyz", tmp_path / "motion.txt")[0] == 0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "holds no LAMMPS dump"),
        ("", "is empty"),
        ("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\n", "cut short before the end of its first"),
        ("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\nx\n", "not a LAMMPS dump"),
    ],
)
def test_a_dump_that_is_none_is_one_line_and_status_2(job, chaincor, content, message):
    dump = job / "dump.lammpstrj"
    dump.unlink()
    if content is not None:
        dump.write_text(content)
    status, _, err = chaincor("analyze", job, "--json")
    assert status == 2
    assert message in err
    assert err.count("\n") == 1


def test_a_missing_folder_is_bad_input(tmp_path, chaincor):
    status, _, err = chaincor("analyze", tmp_path / "nowhere")
    assert status == 2
    assert "is not a folder" in err
