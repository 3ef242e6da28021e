"""Every slip's check comes out as said, and the page about them is the one they make."""

from pathlib import Path

from workflows.reproduce.slips import all_slips, slips_page

PAGE = Path(__file__).parents[3] / "docs" / "paper_slips.md"


def test_every_slip_is_confirmed():
    assert [slip.where for slip in all_slips() if not slip.confirmed] == []


def test_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == slips_page(all_slips())
