"""Further entries of summary.json."""

import json

from taichi_dem.kit.study.summary_entries import add_to_summary


def test_entries_are_added_and_others_stay(tmp_path):
    (tmp_path / "summary.json").write_text('{"experiment": "some", "figures": {}}')
    add_to_summary(str(tmp_path), certificate={"misses": 0})
    found = json.loads((tmp_path / "summary.json").read_text())
    assert found == {"experiment": "some", "figures": {}, "certificate": {"misses": 0}}
