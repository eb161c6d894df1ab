"""Tables with units: read-only, for pandas, xarray and NumPy; libraries that are not there."""

import copy
import csv
import pickle
import sys

import numpy as np
import pandas
import pytest

from taichi_dem import InputError
from taichi_dem.diagnostics.energy_balance import TERMS
from taichi_dem.kit.data_table import Table
from taichi_dem.kit.optional import optional
from taichi_dem.kit.units import ENDINGS, unit_of, without_unit
from tests.made_result import made_result

CHANGES = {
    "set": lambda table: table.__setitem__("time_s", np.zeros(7)),
    "delete": lambda table: table.__delitem__("time_s"),
    "update": lambda table: table.update(time_s=1),
    "pop": lambda table: table.pop("time_s"),
    "popitem": lambda table: table.popitem(),
    "clear": lambda table: table.clear(),
    "setdefault": lambda table: table.setdefault("new", 1),
    "or": lambda table: table.__ior__({"time_s": 1}),
}


@pytest.fixture(scope="module")
def result():
    return made_result()


@pytest.fixture(scope="module")
def tables(result):
    """Every table that a result gives."""
    return {
        "history": result.history,
        "fragments": result.fragments(),
        "cracks": result.cracks(),
        "crack area": result.crack_area(),
        "rose": result.rose(),
        "energy shares": result.energy_shares(),
    }


def test_every_column_has_a_unit(tables):
    for name, table in tables.items():
        assert list(table.units) == list(table), name
        assert all(table.units.values()), (name, table.units)


def test_columns_that_only_some_runs_have_have_a_unit():
    """Of a hole, and of every term of the energy balance."""
    hole = "hole_radial_displacement_mm", "monitor_displacement_mm"
    assert [unit_of(name) for name in hole] == ["mm", "mm"]
    assert {unit_of(f"{name}_J") for name in TERMS} == {"J"}


def test_the_longest_ending_is_the_unit():
    for ending, unit in ENDINGS.items():
        assert unit_of(f"some_{ending}") == unit
        assert without_unit(f"some_thing_{ending}") == "some_thing"
    assert unit_of("what") == unit_of("s") == "" and without_unit("broken_faces") == "broken_faces"


def test_pandas_takes_a_table_as_it_is(tables):
    for table in tables.values():
        direct, made = pandas.DataFrame(table), table.to_pandas()
        pandas.testing.assert_frame_equal(direct, made)
        assert made.attrs["units"] == table.units
        assert list(made.columns) == list(table)
        for name in table:
            assert np.array_equal(made[name].to_numpy(), table[name], equal_nan=True)


def test_xarray_has_all_columns_and_units(tables):
    dims = {"history": "time", "fragments": "fragment", "rose": "angle", "cracks": "row"}
    for name, table in tables.items():
        made = table.to_xarray()
        assert list(made.sizes) == [dims.get(name, "time")]
        for column in table:
            place = without_unit(column) if column == table.index else column
            assert np.array_equal(made[place].to_numpy(), table[column], equal_nan=True)
            assert made[place].attrs["units"] == table.units[column]


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_a_table_refuses_changes(result, change):
    before = result.history.arrays()
    with pytest.raises(InputError, match=r"a Table must not be changed: take arrays\(\)"):
        change(result.history)
    with pytest.raises(ValueError, match="read-only"):
        result.history["kinetic_J"][0] = 1.0
    assert list(before) == list(result.history)
    before["kinetic_J"][0] = -1.0
    assert result.history["kinetic_J"][0] != -1.0


def test_tables_survive_pickle_and_copy(tables):
    for table in tables.values():
        for again in (pickle.loads(pickle.dumps(table)), copy.copy(table), copy.deepcopy(table)):
            assert type(again) is type(table) and list(again) == list(table)
            for name in table:
                assert np.array_equal(again[name], table[name], equal_nan=True)
            assert vars(again).keys() == vars(table).keys() and again.units == table.units
            assert not next(iter(again.values())).flags.writeable


def test_a_table_is_a_mapping_as_before(result):
    history = result.history
    assert {**history, "new": 1}["new"] == 1 and isinstance(history, dict)
    assert history.get("nothing") is None and len(history) == len(list(history))


def test_long_and_wide_tables_are_cut(tables):
    for table in tables.values():
        lines = str(table).splitlines()
        assert max(map(len, lines[:-1])) <= 110 and len(lines) <= 14
        assert f"{table.row_count:,} row" in lines[-1]
        named = [name for name in table if name in lines[0].split() or name in lines[-1]]
        assert named == list(table)
        assert all(name in table._repr_html_() for name in table)


def test_an_empty_table_shows_itself():
    assert str(Table({})).endswith("(0 rows)") and Table({}).row_count == 0
    assert "time_s" in str(Table({"time_s": []}, index="time_s"))
    assert Table({}).to_pandas().empty and not Table({}).to_xarray().sizes


@pytest.mark.parametrize("module", ["pandas", "xarray"])
def test_a_library_that_is_absent_is_named(result, monkeypatch, module):
    monkeypatch.setitem(sys.modules, module, None)
    words = f"{module} must be installed for this: pip install {module}"
    with pytest.raises(InputError, match=words):
        getattr(result.history, f"to_{module}")()
    with pytest.raises(InputError, match=words):
        optional(module)


def test_a_csv_file_has_the_columns(tables, tmp_path):
    for name, table in tables.items():
        table.write_csv(tmp_path / f"{name}.csv")
        with open(tmp_path / f"{name}.csv", newline="") as file:
            head, *rows = csv.reader(file)
        assert head == list(table) and len(rows) == table.row_count
        for k, column in enumerate(table.values()):
            assert np.array_equal([float(row[k]) for row in rows], column, equal_nan=True)
