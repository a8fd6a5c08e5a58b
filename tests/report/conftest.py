"""One browser for all tests of pages."""

from collections.abc import Iterator

import pytest

from chromium import Chromium
from tarsus.solve.page_engine import compiled_engine


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    """The browser, and the engine for pages: reports without it have no explorer."""
    compiled_engine()
    with Chromium(tmp_path_factory.mktemp("chromium") / "profile") as browser:
        yield browser
