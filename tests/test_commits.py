"""Test the subjects of commits since the release, if the history is available."""

import os
import subprocess
from pathlib import Path

import pytest

from tests.programs import ROOT


def git(folder: Path, *arguments: str) -> None:
    settings = ("-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false")
    subprocess.run(["git", *settings, *arguments], cwd=folder, check=True, capture_output=True)


def check(folder: Path) -> subprocess.CompletedProcess[str]:
    # Environment variables must not direct git to another repository.
    clean = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    return subprocess.run(
        [ROOT / ".ci" / "subjects"], cwd=folder, env=clean, capture_output=True, text=True
    )


@pytest.fixture
def repository(tmp_path):
    git(tmp_path, "init")
    git(tmp_path, "commit", "--allow-empty", "-m", "A release may have any subject, " + "x" * 72)
    return tmp_path


@pytest.mark.parametrize(
    ("subject", "status"), [("Add " + "x" * 68, 0), ("Add " + "x" * 69, 1), ("Add a period.", 1)]
)
def test_subjects_since_a_release_are_short(repository, subject, status):
    git(repository, "tag", "v1")
    git(repository, "commit", "--allow-empty", "-m", subject)
    done = check(repository)
    assert done.returncode == status
    assert (subject in done.stdout) == bool(status)


def test_a_history_without_the_release_is_not_checked(repository):
    assert check(repository).returncode == 0
