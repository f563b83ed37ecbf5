"""Runs over processes, Ray and Dask: equal rows, each run once, also when a worker is killed in the middle."""

import os
import signal
import sys

import numpy as np
import pytest

import sonarfix as sf
from sonarfix import distributed

RUNS = 2_000
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")


@pytest.fixture(scope="module")
def expected():
    return sf.Scenario("paper").monte_carlo(RUNS, 0)


def assert_same(table, expected):
    assert table.columns == expected.columns
    for name in table.columns:
        assert table[name].tobytes() == expected[name].tobytes(), name


def killing(pids):
    """Progress that kills a worker once, in the middle."""
    finished = 0
    killed = []

    def progress(runs):
        nonlocal finished
        finished += runs
        if finished >= RUNS // 3 and not killed:
            killed.append(pids()[0])
            os.kill(killed[0], signal.SIGKILL)

    return progress, killed


def children():
    import psutil

    found = psutil.Process().children()
    return [child.pid for child in found if "resource_tracker" not in " ".join(child.cmdline())]


def test_processes(expected):
    pytest.importorskip("psutil")
    progress, killed = killing(children)
    engine = distributed.Processes(2)
    table = distributed.monte_carlo(sf.Scenario("paper"), RUNS, 0, engine=engine, size=50, progress=progress)
    assert len(killed) == 1
    assert_same(table, expected)


def test_ray(expected):
    ray = pytest.importorskip("ray")
    pytest.importorskip("psutil")
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)

    def workers():
        import psutil

        named = psutil.process_iter(["name", "pid", "cmdline"])
        return [one.pid for one in named if "ray::_compute" in " ".join(one.info["cmdline"] or [])]

    try:
        progress, killed = killing(workers)
        engine = distributed.Ray()
        paper = sf.Scenario("paper")
        table = distributed.monte_carlo(paper, RUNS, 0, engine=engine, size=50, progress=progress)
    finally:
        ray.shutdown()
    assert len(killed) == 1
    assert_same(table, expected)


def test_dask(expected):
    dask = pytest.importorskip("distributed")
    cluster = dask.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster, dask.Client(cluster) as client:
        progress, killed = killing(lambda: list(client.run(os.getpid).values()))
        engine = distributed.Dask(client)
        paper = sf.Scenario("paper")
        table = distributed.monte_carlo(paper, RUNS, 0, engine=engine, size=50, progress=progress)
    assert len(killed) == 1
    assert_same(table, expected)


@pytest.mark.parametrize("size", [1, 7, 1_000])
def test_the_size_of_the_parts_does_not_matter(expected, size):
    table = distributed.monte_carlo(sf.Scenario("paper"), 20, 0, engine=distributed.Processes(2), size=size)
    assert table["seed"].tolist() == list(range(20))
    assert table["nees"].tobytes() == expected["nees"][:20].tobytes()


def test_a_worker_that_always_dies_is_an_error():
    with pytest.raises(sf.SonarfixError, match="died"):
        distributed.monte_carlo(sf.Scenario("paper"), 2, 0, engine=distributed.Processes(1), estimator=Deadly)


class Deadly:
    """Ends its process."""

    def __init__(self, setup):
        os._exit(3)


def test_parquet(tmp_path, expected):
    duckdb, polars = pytest.importorskip("duckdb"), pytest.importorskip("polars")
    pytest.importorskip("pyarrow")
    paper, folder = sf.Scenario("paper"), tmp_path / "rows"
    engine = distributed.Processes(2)
    # Interrupted after the first part, then resumed.
    with pytest.raises(KeyboardInterrupt):
        distributed.to_parquet(paper, folder, 200, 0, engine=engine, size=50, progress=interrupt)
    counts = []
    distributed.to_parquet(paper, folder, 200, 0, engine=engine, size=50, progress=counts.append)
    assert 0 < sum(counts) < 200
    assert len(list(folder.glob("*.parquet"))) == 4
    read = duckdb.sql(f"select * from '{folder}/*.parquet' order by seed").fetchnumpy()
    frame = polars.scan_parquet(folder / "*.parquet").sort("seed").collect()
    for name in expected.columns:
        values = expected[name][:200]
        assert np.asarray(read[name]).tobytes() == values.tobytes(), name
        assert frame[name].to_numpy().tobytes() == values.tobytes(), name
    with pytest.raises(sf.InputError, match="other runs"):
        distributed.to_parquet(paper, folder, 201, 0, engine=engine, size=50)


def interrupt(runs):
    raise KeyboardInterrupt


def test_a_sweep():
    paper = sf.Scenario("paper")
    keys = {"sonar.noise": ["2 mm", "5 mm"], "truth.scale_right": [0.0, 0.01]}
    points = distributed.sweep(paper, keys, 3, 1, engine=distributed.Processes(2), size=2)
    assert [point for point, _ in points] == [
        {"sonar.noise": noise, "truth.scale_right": scale} for noise in ["2 mm", "5 mm"] for scale in [0.0, 0.01]
    ]
    for point, table in points:
        assert_same(table, paper.replace(point).monte_carlo(3, 1))


@pytest.mark.parametrize("arguments", [{"runs": 0}, {"size": 0}, {"seed": -1}, {"seed": 2**64}])
def test_wrong_arguments(arguments):
    with pytest.raises(sf.InputError):
        distributed.parts(sf.Scenario("paper"), **arguments)
