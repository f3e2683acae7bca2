"""The paper's case, for all tests of linear analysis."""

import pytest

import drillctl


@pytest.fixture(scope="session")
def design():
    return drillctl.load("monteiro-trindade-140kn")
