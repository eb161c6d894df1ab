"""Tables of sweeps: all forms give the same rows, and each defect is one sentence."""

import numpy as np
import pytest

from taichi_dem import InputError, parameter_grid
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.sweeps.job import run_job
from taichi_dem.kit.sweeps.rows import checked_rows

ROWS = [{"x": 1, "y": 0.5, "w": "a"}, {"x": 2, "y": 1e-300, "w": "b c"}]


def test_all_forms_of_a_table_give_the_same_rows(tmp_path):
    (tmp_path / "t.csv").write_text("x,y, w\n1,0.5,a\n\n2,1e-300,b c\n")
    columns = {"x": np.array([1, 2]), "y": (0.5, 1e-300), "w": ["a", "b c"]}
    for table in (ROWS, columns, tmp_path / "t.csv", str(tmp_path / "t.csv"), iter(ROWS)):
        found = checked_rows(table)
        assert found == ROWS
        assert [type(value) for value in found[0].values()] == [int, float, str]


def test_a_data_frame_is_a_table():
    pandas = pytest.importorskip("pandas")
    assert checked_rows(pandas.DataFrame(ROWS)) == ROWS


def test_numbers_lose_no_bit_on_the_way(tmp_path):
    numbers = np.random.default_rng(1).standard_normal(50) * 10.0 ** np.arange(-25, 25)
    (tmp_path / "t.csv").write_text("\n".join(["x", *map(repr, numbers.tolist())]))
    assert [row["x"] for row in checked_rows(tmp_path / "t.csv")] == numbers.tolist()
    assert [row["x"] for row in checked_rows({"x": numbers})] == numbers.tolist()


def test_a_grid_has_all_combinations_the_last_column_fastest():
    grid = parameter_grid(a=[1, 2], b=np.array([3.0, 4.0]), c="x y".split())
    assert len(grid) == 8 == len({tuple(row.values()) for row in grid})
    assert grid[1] == {"a": 1, "b": 3.0, "c": "y"}


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ([], "a table must have at least one row, got none"),
        ({}, "at least one row"),
        ([{}], "at least one column"),
        ({"x": []}, "at least one row"),
        ({"x": 1.0}, "column x must be a list of values, got 1.0"),
        ({"x": "abc"}, "column x must be a list"),
        ({"x": [1], "y": [1, 2]}, "columns of a table must be equally long"),
        ([{"x": 1}, {"x": 1, "peek": 2}], "row 1 has the unknown column 'peek'"),
        ([{"x": 1}, {}], "row 1 has an empty cell under 'x'"),
        ([{"x": 1}, {"x": None}], "row 1 has an empty cell under 'x'"),
        ({"x": [1.0, np.nan]}, "row 1 has an empty cell under 'x'"),
        ({"x": ["", "a"]}, "row 0 has an empty cell under 'x'"),
        ({"x": [1j]}, "x of row 0 must be a number or text, got 1j"),
        ({"x": [[1]]}, r"x of row 0 must be a number or text, got \[1\]"),
        ({"x": np.ones((2, 2))}, r"x of row 0 must be a number or text, got array"),
        ([{"x": np.ones(3)}], r"x of row 0 must be a number or text, got array"),
        ({"x": np.array(1.0)}, "column x must be a list of values, got array"),
        ({"x": ["\udc80"]}, "x of row 0 must be text without NUL that UTF-8 can hold"),
        ({"x": ["a\0"]}, "x of row 0 must be text without NUL"),
        (np.array(1.0), "a table must be rows"),
        ({"x": [2**63]}, "x of row 0 must be a number or text, got 9223372036854775808"),
        ({"error": [1]}, "a column of a table must have a name other than error, version"),
        ([{1: 2}], "must have a name other than .*, got 1"),
        (3, "a table must be rows, columns or the name of a CSV file, got 3"),
        (None, "a table must be rows"),
        ([1, 2], "a table must be rows"),
        ("none.csv", "table none.csv cannot be read: No such file"),
        ("a\0b", "table must be the name of a file"),
    ],
)
def test_a_table_with_a_defect_is_one_sentence(table, words):
    with pytest.raises(InputError, match=words) as error:
        checked_rows(table)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must have a header and at least one row, got 0 lines"),
        ("x,y\n", "at least one row, got 1 lines"),
        ("x,x\n1,2\n", "must name each column once, got 'x' twice"),
        ("x,\n1,2\n", "must name each column, got an empty name"),
        ("x,y\n1,2\n1\n", "row 1 of table .* must have 2 cells, got 1"),
        ("x,y\n1,2,3\n", "row 0 of table .* must have 2 cells, got 3"),
        ("x,y\n1, \n", "row 0 of table .* has an empty cell under 'y'"),
        ("x,y\n1,nan\n", "row 0 has an empty cell under 'y'"),
        ("x,y\n1,-1e400\n", "numbers of a table must be below 1.8e308 in size, got -1e400"),
        ('x,y\n1,"2\n', "cannot be read"),
        (b"x\n\xff\n", "cannot be read"),
    ],
)
def test_a_file_with_a_defect_is_one_sentence(tmp_path, text, words):
    path = tmp_path / "t.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=words):
        checked_rows(path)


def test_a_grid_with_a_defect_is_one_sentence():
    for columns, words in (({}, "at least one column"), ({"x": 1}, "must be a list of values")):
        with pytest.raises(InputError, match=words):
            parameter_grid(**columns)


def test_frames_that_would_lose_a_column_or_are_none_are_refused():
    pandas = pytest.importorskip("pandas")
    double = pandas.DataFrame([[1, 2]], columns=["x", "x"])
    with pytest.raises(InputError, match="a table must name each column once, got 'x' twice"):
        checked_rows(double)
    with pytest.raises(InputError, match="a table must be rows, columns or the name of a CSV"):
        checked_rows(pandas.Series([1, 2]))
    with pytest.raises(InputError, match="row 1 has an empty cell under 'x'"):
        checked_rows(pandas.DataFrame({"x": pandas.array([1, None], dtype="Int64")}))


def test_text_with_an_underscore_is_no_number(tmp_path):
    (tmp_path / "t.csv").write_text("x,y\n1_000,2024_01\n")
    assert checked_rows(tmp_path / "t.csv") == [{"x": "1_000", "y": "2024_01"}]


@pytest.mark.parametrize("name", ["x\udcff", "x\0"])
def test_a_name_that_no_file_holds_is_refused_before_it_is_kept(tmp_path, name):
    with pytest.raises(InputError, match=r"^the name of a column must be text without NUL"):
        checked_rows({name: [1]})
    record = run_job(lambda row: {name: 1.0}, {"x": 1})
    assert record.error.startswith("the name of a result must be text without NUL that UTF-8")
    with pytest.raises(InputError, match=r"^cannot write .*no text of UTF-8$"):
        write_csv(tmp_path / "a.csv", {"x\udcff": [1.0]})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("value", [np.timedelta64(5, "ns"), np.datetime64("2020-01-01", "ns")])
def test_a_duration_or_date_is_no_number(value):
    with pytest.raises(InputError, match="x of row 0 must be a number or text, got"):
        checked_rows([{"x": value}])
