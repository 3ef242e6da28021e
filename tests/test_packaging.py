"""Test the wheels of the build backend, from checkouts with and without symbolic links."""

import re
import runpy
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from tests.programs import ROOT

_PACKAGES = ("analysis", "lammps_inputs", "workflows")


def build(checkout: Path, kind: str) -> subprocess.CompletedProcess[str]:
    """Build a wheel or an editable wheel in ``checkout/dist``, as pip does."""
    code = f"import hatchling.build as b; b.{kind}('dist')"
    (checkout / "dist").mkdir(exist_ok=True)
    return subprocess.run(
        [sys.executable, "-c", code], cwd=checkout, capture_output=True, text=True, check=False
    )


def names_in_wheel(checkout: Path) -> set[str]:
    """Return the top-level entries of the package in the wheel."""
    (wheel,) = (checkout / "dist").glob("*.whl")
    names = [name.split("/") for name in zipfile.ZipFile(wheel).namelist()]
    return {parts[1] for parts in names if parts[0] == "chaincor"}


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Return a checkout with one module in each folder and all files that the build names."""
    for name in ("README.md", "LICENSE", "pyproject.toml", "hatch_build.py"):
        shutil.copy(ROOT / name, tmp_path)
    (tmp_path / "chaincor").mkdir()
    (tmp_path / "chaincor" / "__init__.py").touch()
    for name in _PACKAGES:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
        (tmp_path / "chaincor" / name).symlink_to(f"../{name}")
    for page in map(Path, runpy.run_path(str(ROOT / "hatch_build.py"))["PAGES"]):
        (tmp_path / page.parent).mkdir(parents=True, exist_ok=True)
        (tmp_path / page).touch() if page.suffix else (tmp_path / page).mkdir(exist_ok=True)
    return tmp_path


def without_links(checkout: Path) -> None:
    """Replace each link by the file of one line that git or a zip archive has instead."""
    for name in _PACKAGES:
        (checkout / "chaincor" / name).unlink()
        (checkout / "chaincor" / name).write_text(f"../{name}")


def test_an_editable_install_copies_nothing(checkout):
    # A copy in site-packages would become outdated, and mypy and editors would read the copy first.
    done = build(checkout, "build_editable")
    assert done.returncode == 0, done.stderr
    assert names_in_wheel(checkout) == set()


@pytest.mark.parametrize("links", [True, False])
def test_a_wheel_holds_the_folders(checkout, links):
    if not links:
        without_links(checkout)
    done = build(checkout, "build_wheel")
    assert done.returncode == 0, done.stderr
    assert names_in_wheel(checkout) == {"__init__.py", "docs", *_PACKAGES}


def test_an_editable_install_without_links_says_in_one_line_what_to_do(checkout):
    without_links(checkout)
    done = build(checkout, "build_editable")
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert "chaincor/analysis is a file; expected a symbolic link" in line
    assert "core.symlinks" in line


def test_the_version_is_the_same_wherever_it_is_written():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    released = re.search(r"^## \[(\d.*)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text(), re.M)
    cited = (ROOT / "CITATION.cff").read_text()
    assert released[1] == version
    assert f"\nversion: {version}\ndate-released: {released[2]}\n" in cited


def test_the_conda_recipe_asks_for_what_the_package_asks_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    recipe = (ROOT / "packaging" / "recipe.yaml").read_text()
    run = recipe.partition("  run:\n")[2].partition("\ntests:")[0]
    asked = dict(re.findall(r"^    - (\S+) >=(.*)$", run, re.M))
    assert asked.pop("python") == "${{ python_min }}"
    # conda writes dates with zeros, has other package names, and includes MPI in its LAMMPS.
    asked["lammps"] = asked["lammps"].replace(".0", ".") + ".0.0"
    asked["matplotlib"] = asked.pop("matplotlib-base")
    wanted = dict(each.partition(";")[0].split(">=") for each in project["dependencies"])
    del wanted["mpich"]
    assert asked == {name.lower().replace("_", "-"): least for name, least in wanted.items()}
    assert f'version: "{project["version"]}"' in recipe
    assert f'python_min: "{project["requires-python"].removeprefix(">=")}"' in recipe


def test_the_paper_cites_what_its_bibliography_has_and_shows_pictures_that_are_there():
    paper, bibliography = ((ROOT / f"paper.{kind}").read_text() for kind in ("md", "bib"))
    entries = re.findall(r"^@\w+\{(\w+),", bibliography, re.M)
    assert sorted(set(re.findall(r"[\[; ]@(\w+)", paper))) == sorted(entries)
    pictures = re.findall(r"\]\((docs/\S+)\)", paper)
    assert len(pictures) == 2
    assert all((ROOT / picture).is_file() for picture in pictures)
