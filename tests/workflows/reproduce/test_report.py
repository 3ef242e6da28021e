"""Test that the report is complete, self-contained, and computed only once."""

import csv
import json
import re
import shutil
from dataclasses import replace

import pytest
from jinja2 import DictLoader, Environment
from rocrate.rocrate import ROCrate

from chaincor.analysis.output_paths import judge_folder
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.pages.typesetting import mark_up
from chaincor.workflows.reproduce import report, reproduction
from chaincor.workflows.reproduce.measuring import run_into_store
from chaincor.workflows.reproduce.paper import CLAIMS
from chaincor.workflows.reproduce.plan import QUICK
from chaincor.workflows.reproduce.report import PAGES, SIGN
from chaincor.workflows.reproduce.reproduction import (
    describe_reproduction,
    reproduce,
    reproduce_paper,
)
from chaincor.workflows.store.results_store import Store
from tests.page_checks import read_page

TINY = replace(
    QUICK,
    curve_particles=10,
    curve_speeds=(0.4, 0.8, 1.5),
    harmonic_sizes=(10, 30),
    harmonic_far_sizes=(40,),
    harmonic_velocities=(0.1,),
    sizes=(10,),
    far_sizes={0.39: (20,)},
    increase_speeds=dict.fromkeys((3, 4, 5), (0.01, 0.02, 0.04)),
    increase_tolerances=dict.fromkeys((3, 4, 5), 1e-5),
    slope_sizes=(10,),
    slope_far_sizes=(20,),
    slope_speeds=(0.05, 0.1),
    harmonic_longest=(100, 300),
    slow_sizes=(30,),
    slow_variables=(1.0, 5.0),
    pair_speeds=(0.01, 0.02, 0.05, 0.1),
)


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    """Return the folder and the content of its report."""
    folder = tmp_path_factory.mktemp("reproduction")
    run = run_into_store(folder / "results.sqlite", 2, progress=False)
    return folder, reproduce_paper(TINY, folder, run)


@pytest.fixture(scope="module")
def folder(reproduced):
    return reproduced[0]


def test_a_report_replaces_an_earlier_one(tmp_path, monkeypatch):
    pages = {f"{name}.j2": "<!DOCTYPE html>\n{{ number }}" for name in PAGES}
    environment = Environment(loader=DictLoader(pages))
    monkeypatch.setattr(report, "page_environment", lambda _: environment)
    for number in (1, 2):
        report.write_report(tmp_path, {"number": number}, {})
        judge_folder(tmp_path, SIGN, PAGES)
        assert json.loads((tmp_path / SIGN).read_text())["number"] == number
        for name in PAGES:
            assert (tmp_path / name).read_text().endswith(str(number))


@pytest.mark.parametrize("name", ["report.html", "report.md"])
def test_a_page_of_ones_own_is_no_report(tmp_path, name):
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match="holds files of something else"):
        reproduce(tmp_path, progress=False)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.slow
def test_page_is_whole_in_one_file(folder):
    page = read_page(folder / "report.html")
    # Other content is in files beside the page and is opened only by a click.
    sources = re.findall(r'(?:src|href)="([^"]{0,30})', page)
    assert sources
    assert all(s.startswith(("data:image/", "#", "figures/", "report.json")) for s in sources)


@pytest.mark.slow
def test_every_figure_and_verdict_is_there(folder):
    contents = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    assert [row["key"] for row in contents["verdicts"]] == [claim.key for claim in CLAIMS]
    page = (folder / "report.html").read_text(encoding="utf-8")
    for figure in contents["figures"]:
        for kind in ("png", "svg"):
            assert (folder / "figures" / f"{figure['key']}.{kind}").stat().st_size > 5000
        assert f'id="{figure["key"]}"' in page
    assert len(contents["figures"]) >= 7
    for row in contents["verdicts"]:
        assert mark_up(row["margin_reason"]) in page
        assert mark_up(row["brief"]) in page
    for reading in contents["readings"]:
        assert mark_up(reading["question"]) in page
    assert contents["slip_count"] in page


@pytest.mark.slow
def test_the_command_prints_curves_verdicts_and_where_the_report_is(
    reproduced, chaincor, monkeypatch
):
    folder, contents = reproduced
    monkeypatch.setattr(reproduction, "reproduce", lambda *_, **__: contents)
    status, out, _ = chaincor("reproduce", "-o", folder)
    assert status == 0
    lines = out.splitlines()
    curves = {(point["speed"], point["potential"]) for point in contents["curves"]}
    for speed in TINY.curve_speeds:
        (line,) = (line for line in lines if line.startswith(f"{speed:8.4g} "))
        assert len(line.split()) == 1 + 2 * sum(at == speed for at, _ in curves)
    for row in contents["verdicts"]:
        assert any(x.startswith(f"{row['verdict']:<28} {row['claim']} ") for x in lines)
    health = contents["health"]
    assert f"{health['compared']} of {health['points']} points were computed by LAMMPS" in out
    assert lines[-1] == f"report: {folder / 'report.html'}"
    status, out, _ = chaincor("reproduce", "-o", folder, "--json")
    assert (status, out) == (0, (folder / "report.json").read_text(encoding="utf-8") + "\n")
    # A report without LAMMPS results is not the requested report.
    monkeypatch.setitem(health, "by_lammps", 0)
    assert chaincor("reproduce", "-o", folder)[0] == 1


@pytest.mark.slow
def test_a_crate_describes_every_file(folder, tmp_path):
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    there = {p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*") if p.is_file()}
    describe_reproduction(tmp_path, json.loads((folder / "report.json").read_text("utf-8")))
    described = {entity.id: entity for entity in ROCrate(tmp_path).data_entities}
    assert set(described) == there
    assert all(entity["description"] for entity in described.values())


@pytest.mark.slow
def test_curves_are_written_with_all_digits(folder):
    with (folder / "figures" / "restitution_curves.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 9
    with Store(folder / "results.sqlite", read_only=True) as store:
        _, kept = store.select(
            "SELECT restitution FROM collisions WHERE engine = 'lammps' AND potential = 'toda'"
        )
    written = {float(row["restitution"]) for row in rows if row["potential"] == "toda"}
    assert written == {value for (value,) in kept}


@pytest.mark.slow
def test_a_store_is_carried_on_and_its_versions_are_all_named(folder, tmp_path):
    # The store imitates one that other versions began: all results but one are from these versions.
    shutil.copy(folder / "results.sqlite", tmp_path)
    with Store(tmp_path / "results.sqlite") as store:
        execute = store.connection.execute
        execute(
            "INSERT INTO environments (versions) "
            "SELECT json_set(versions, '$.lammps', '2024.8.29') FROM environments"
        )
        execute(
            "UPDATE collisions SET environment = (SELECT max(id) FROM environments) "
            "WHERE rowid = (SELECT max(rowid) FROM collisions WHERE engine = 'lammps')"
        )

    def record():
        with Store(tmp_path / "results.sqlite", read_only=True) as store:
            return store.select("SELECT collision_sha256, tries, finished FROM collisions")

    recorded = record()
    reproduce_paper(TINY, tmp_path, run_into_store(tmp_path / "results.sqlite", 2, progress=False))
    assert record() == recorded  # finished results are not computed again
    before = json.loads((folder / "report.json").read_text(encoding="utf-8"))["versions"]
    versions = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["versions"]
    assert versions.pop("lammps") == " and ".join(sorted([before.pop("lammps"), "2024.8.29"]))
    assert versions == before
