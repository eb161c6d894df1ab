"""Every wrong value of every public parameter is refused in one sentence."""

import pytest

from tests.bad_input.test_calls import faults
from tests.public_api import PACKAGES

pytestmark = pytest.mark.attack


@pytest.mark.parametrize("package", PACKAGES)
def test_no_parameter_takes_any_wrong_value(package, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert not [*faults(package, 1000, seed=0)]
