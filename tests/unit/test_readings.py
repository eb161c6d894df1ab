"""Tables of a run at rest are read once."""

from taichi_dem.diagnostics.readings import Readings


def test_a_table_is_read_once_in_a_block_and_anew_outside():
    readings, calls = object.__new__(Readings), []
    readings._held = None

    def read():
        calls.append(len(calls))
        return calls[-1]

    assert [readings._once("a", read), readings._once("a", read)] == [0, 1]
    with readings.held():
        assert [readings._once("a", read), readings._once("b", read)] == [2, 3]
        with readings.held():
            assert readings._once("a", read) == 2
        assert readings._once("b", read) == 3
    with readings.held():
        assert readings._once("a", read) == 4
