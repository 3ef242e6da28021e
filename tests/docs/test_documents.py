"""Every code block of the documentation runs and prints what the page says."""

import pytest

from tests.docs.documents import DOCUMENTS, ROOT, run_document

# Pages without a block of code have nothing to run.
_WITH_CODE = [
    path
    for path in DOCUMENTS
    if any(f"```{kind}\n" in path.read_text() for kind in ("python", "console", "toml"))
]


@pytest.mark.slow
@pytest.mark.parametrize("path", _WITH_CODE, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_block_runs(path, tmp_path):
    assert run_document(path, tmp_path) > 0


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
