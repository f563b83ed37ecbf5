"""Tables, and the programs that read them."""

import pickle

import numpy as np
import pytest

import sonarfix as sf


@pytest.fixture(scope="module")
def tables():
    run = sf.Scenario("classroom").run(0)
    return [run.trace, run.ticks, run.fixes, run.row, sf.Scenario("paper").map.check()]


def test_a_table_has_its_columns(tables):
    for table in tables:
        structured = table.to_numpy()
        assert list(structured.dtype.names) == table.columns
        assert len(structured) == len(table)
        for name in table.columns:
            assert table[name].shape == (len(table),)
            assert name in table
    with pytest.raises(KeyError):
        tables[0]["nothing"]


def test_a_table_is_pickled_and_joined_to_the_bit(tables):
    for table in tables:
        again = pickle.loads(pickle.dumps(table))
        twice = sf.Table.concat([table, again])
        assert again.columns == twice.columns == table.columns
        for name in table.columns:
            assert again[name].tobytes() == table[name].tobytes(), name
            assert twice[name].tobytes() == np.concatenate([table[name]] * 2).tobytes(), name


def test_pandas_polars_pyarrow_and_duckdb_read_tables(tables):
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    pyarrow, duckdb = pytest.importorskip("pyarrow"), pytest.importorskip("duckdb")
    table = tables[0]
    frame = pandas.DataFrame.from_arrow(table) if hasattr(pandas.DataFrame, "from_arrow") else None
    arrow = pyarrow.table(table)
    assert arrow.column_names == table.columns
    # An unknown value is null, not NaN.
    assert arrow["fix_range_m"].null_count == int(np.isnan(table["fix_range_m"]).sum()) > 0
    assert polars.DataFrame(table)["fix_outcome"].null_count() == int((table["fix_outcome"] == "").sum())
    ((count,),) = duckdb.sql("select count(*) from arrow where verdict = 'tracking'").fetchall()
    assert count == int((table["verdict"] == "tracking").sum())
    if frame is not None:
        assert frame["x_m"].to_numpy().tobytes() == table["x_m"].tobytes()


@pytest.mark.parametrize(
    "columns",
    [
        {"a": np.zeros(2), "b": np.zeros(3)},
        {"a": np.zeros((2, 2))},
        {"a": np.zeros(2, dtype="f4")},
        {"a": [1.0]},
        {1: np.zeros(1)},
        {"a": np.array([None])},
    ],
)
def test_tables_that_are_none(columns):
    with pytest.raises((TypeError, ValueError)):
        sf.Table(columns)


def test_no_table_is_joined_from_nothing_or_from_others(tables):
    with pytest.raises(ValueError, match="no table"):
        sf.Table.concat([])
    with pytest.raises(ValueError, match="different columns"):
        sf.Table.concat(tables)
