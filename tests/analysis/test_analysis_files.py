import csv
import json

import numpy as np
import pytest
from PIL import Image

from chaincor.analysis.analysis_files import to_json_object, write_analysis
from chaincor.analysis.collision_figures import caption_of
from chaincor.analysis.collision_frames import Known
from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones

FIGURES = ["bonds", "contacts", "energy", "mode_heat_map", "spectrum", "trajectories"]


@pytest.fixture
def analysis(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, np.arange(0.0, 90.0, 0.5))
    return analyze_frames(Dump(path), Known(bond=Harmonic()))


def test_report_holds_the_numbers(analysis, tmp_path):
    write_analysis(analysis, tmp_path / "out", figures=False)
    result = json.loads((tmp_path / "out" / "analysis.json").read_text())
    assert result == to_json_object(analysis)
    assert result["restitution"] == analysis.restitution
    assert result["contacts"] == 17
    assert result["kinematic_restitution"] ** 2 == pytest.approx(result["restitution"])
    assert result["v_star"] is None
    assert sum(result["mode_energies"]) == pytest.approx(result["energy_end"], rel=1e-13)
    with np.load(tmp_path / "out" / "arrays.npz") as arrays:
        np.testing.assert_array_equal(arrays["mode_energies"], analysis.mode_energies)
        assert arrays["displacements"].shape == (180, 20)
    with (tmp_path / "out" / "contacts.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["time"]) for row in rows] == analysis.contact_times.tolist()
    assert rows[0]["interval"] == ""
    with (tmp_path / "out" / "modes.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["energy"]) for row in rows] == analysis.mode_energies.tolist()
    assert rows[1]["basile_dumont_energy"] != ""


@pytest.mark.slow
def test_report_draws_every_figure_and_says_what_it_shows(analysis, tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    save, captions = Figure.savefig, {}

    def keep(figure, path, **options):
        captions[path.stem] = figure.get_suptitle()
        save(figure, path, **options)

    monkeypatch.setattr(Figure, "savefig", keep)
    write_analysis(analysis, tmp_path)
    for name in FIGURES:
        assert captions[name].startswith("harmonic, ")
        assert captions[name].endswith(f"= {analysis.restitution:.5g}")
        with Image.open(tmp_path / f"{name}.png") as image:
            assert image.size[0] == 1200
            assert "harmonic, n = 20" in image.text["Description"]
            # A figure that is not blank has pixels of many colours.
            assert len(image.convert("RGB").getcolors(1_000_000)) > 20


def test_a_bond_not_known_is_null(harmonic20, dump_writer, tmp_path):
    path = dump_writer.write(harmonic20, np.arange(0.0, 90.0, 0.5))
    unknown = analyze_frames(Dump(path))
    result = to_json_object(unknown)
    assert result["potential"] is None
    assert result["energy_drift"] is None
    assert "not known" in caption_of(unknown)
    write_analysis(unknown, tmp_path)
    named = analyze_frames(Dump(path), Known(bond=LennardJones()))
    assert "v^*" in caption_of(named)
