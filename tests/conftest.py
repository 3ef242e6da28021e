"""Options and settings that all tests share."""

import pytest
from hypothesis import settings

# The machine's load must not decide whether a property holds.
settings.register_profile("chaincor", deadline=None, max_examples=60, derandomize=True)
settings.load_profile("chaincor")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the golden files under tests/golden anew instead of comparing with them",
    )


@pytest.fixture
def update_golden(request: pytest.FixtureRequest) -> bool:
    return request.config.getoption("--update-golden")
