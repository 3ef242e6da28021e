"""Test that every code block of the documentation runs and prints what the page shows."""

import re

import pytest

from chaincor.workflows.command_list import COMMANDS
from tests.docs.documents import DOCUMENTS, ROOT, run_document

LESSONS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
# These pages have code blocks. Lessons are not among them: other tests run each lesson as a
# notebook and compare its output.
_WITH_CODE = [
    path
    for path in DOCUMENTS
    if path not in LESSONS
    and any(f"```{kind}\n" in path.read_text() for kind in ("python", "console", "toml"))
]


@pytest.mark.slow
@pytest.mark.parametrize("path", _WITH_CODE, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_block_runs(path, tmp_path):
    assert run_document(path, tmp_path) > 0


def test_the_front_page_quotes_the_bottom_line_of_timestep():
    # The page on scripts runs the script that prints this line.
    (line,) = re.findall(r"^> (Your .*) \.\.\.$", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert f"\n{line}" in (ROOT / "docs" / "scripts.md").read_text()


@pytest.mark.slow
def test_all_lessons_in_order_in_one_folder(tmp_path):
    # The lessons run in one folder, as a reader runs them. No lesson may disturb the next.
    assert len(LESSONS) == 8
    for path in LESSONS:
        assert run_document(path, tmp_path) > 0


@pytest.mark.slow
def test_what_help_prints_can_be_typed(tmp_path, chaincor):
    examples = []
    for name in COMMANDS:
        _, printed, _ = chaincor(name, "--help")
        examples += re.findall(r"^ {2,}(chaincor (?!COMMAND|\[).*)", printed, re.MULTILINE)
    assert len(examples) >= 6
    page = tmp_path / "page.md"
    page.write_text(
        "```toml\n# scene.toml\nspeed = 0.4\n```\n\n```console\n"
        + "".join(f"$ {example}\n" for example in examples)
        + "$ chaincor inputs --particles 5 -o DIR\n"
        + "$ "
        + re.search(r"`(\(cd DIR .*?\))`", chaincor("inputs", "--help")[1])[1]
        + "\n```\n"
    )
    (tmp_path / "run").mkdir()
    assert run_document(page, tmp_path / "run") == 2


def test_a_command_finds_what_those_before_it_left_behind(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```console\n$ cd /\n$ X=1\n```\n\n```console\n$ echo $PWD $X\n/ 1\n```\n")
    (tmp_path / "run").mkdir()
    assert run_document(page, tmp_path / "run") == 2


def test_a_busy_machine_prints_nothing_else(tmp_path):
    page = tmp_path / "page.md"
    said = "chaincor: running, longer than the 0.03 s that were expected, after 60 s"
    counted = "chaincor: 1 of 200 collisions, 0 % of the work, done after 2.1 min"
    page.write_text(f"```console\n$ echo '{said}'; echo '{counted}'; echo 3\n3\n```\n")
    (tmp_path / "run").mkdir()
    assert run_document(page, tmp_path / "run") == 1


@pytest.mark.parametrize("command", ["exit 0", "kill -9 $$"])
def test_a_shell_that_ends_is_found(tmp_path, command):
    page = tmp_path / "page.md"
    page.write_text(f"```console\n$ {command}\n```\n")
    (tmp_path / "run").mkdir()
    with pytest.raises(AssertionError, match="the shell ended"):
        run_document(page, tmp_path / "run")


def test_a_wrong_output_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```console\n$ echo 3\n4\n```\n")
    (tmp_path / "run").mkdir()
    with pytest.raises(Exception, match="expected:\n4"):
        run_document(page, tmp_path / "run")


def test_a_failing_command_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```console\n$ false\n```\n")
    (tmp_path / "run").mkdir()
    with pytest.raises(AssertionError, match="exit status 1"):
        run_document(page, tmp_path / "run")
