"""Monte Carlo and sweeps where one process is not enough: over concurrent.futures, Ray or Dask.

The seeds are split into parts. Each part is a task of the engine, which schedules it and repeats it if its worker dies; a part
has the same rows wherever it is computed, so that the table equals that of one process to the bit. Storage is Parquet
through pyarrow, one file a part, which DuckDB, polars and pandas read back.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple, Union

from ._sonarfix import Scenario, Table
from .errors import InputError, SonarfixError

Progress = Callable[[int], object]
"""Called with the number of newly finished runs, like ``tqdm(total=runs).update``."""

PART = 64
"""Usual number of runs of a part: what is computed again after a worker died."""

RETRIES = 3
"""How often a part is repeated whose worker died."""


class Part(NamedTuple):
    """Runs with consecutive seeds, the unit of work."""

    scenario: Scenario
    """The scenario."""
    seed: int
    """The first seed."""
    runs: int
    """The number of runs."""
    options: dict[str, Any]
    """Estimator and policy."""

    def compute(self) -> Table:
        """The rows of the part, on one core."""
        if self.options:
            return self.scenario.monte_carlo(self.runs, self.seed, **self.options)
        return self.scenario.monte_carlo(self.runs, self.seed, workers=1)


def parts(
    scenario: Scenario,
    runs: int | None = None,
    seed: int | None = None,
    *,
    size: int = PART,
    **options: Any,
) -> list[Part]:
    """The parts of a Monte Carlo: the seeds ``seed``, ``seed + 1``, … in parts of ``size`` runs.

    ``runs`` and ``seed`` are by default those of the scenario; ``options`` are ``estimator`` and ``policy``, which the engine
    must be able to pickle.
    """
    runs = scenario.runs if runs is None else runs
    first = scenario.seed if seed is None else seed
    if runs < 1 or size < 1 or not 0 <= first < 2**64:
        raise InputError("runs and size must be at least 1, and the seed from 0 to 2**64 - 1")
    begins = range(0, runs, size)
    return [Part(scenario, (first + at) % 2**64, min(size, runs - at), options) for at in begins]


def _compute(part: Part) -> Table:
    return part.compute()


class Engine:
    """Where parts are computed: the engines below have this interface."""

    def compute(self, work: Sequence[Part]) -> Iterator[tuple[int, Table]]:
        """The number of each part and its rows, in the order in which they are finished."""
        raise NotImplementedError


class Processes(Engine):
    """Processes of this machine by concurrent.futures.

    ``workers`` is their number, by default the number of cores. A process that dies is replaced, and the parts that were
    not finished are computed again. With an ``executor`` of your own (for example of mpi4py) a broken one is not replaced.
    """

    def __init__(self, workers: int | None = None, *, executor: Executor | None = None) -> None:
        self._workers = workers
        self._executor = executor

    def compute(self, work: Sequence[Part]) -> Iterator[tuple[int, Table]]:
        """The number of each part and its rows, in the order in which they are finished."""
        left = dict(enumerate(work))
        if self._executor is not None:
            yield from self._finished(self._executor, left)
            return
        for attempt in itertools.count(1):
            # A forked process would have the locks of threads that it does not have.
            context = get_context("spawn")
            with ProcessPoolExecutor(self._workers, mp_context=context) as executor:
                try:
                    yield from self._finished(executor, left)
                    return
                except BrokenProcessPool as error:
                    if attempt > RETRIES:
                        raise SonarfixError(f"a worker died {attempt} times: {error}") from error

    def _finished(self, executor: Executor, left: dict[int, Part]) -> Iterator[tuple[int, Table]]:
        futures = {executor.submit(_compute, part): number for number, part in left.items()}
        try:
            for future in as_completed(futures):
                number = futures[future]
                table = future.result()
                del left[number]
                yield number, table
        finally:
            for future in futures:
                future.cancel()


class Ray(Engine):
    """A Ray cluster (``pip install sonarfix[ray]``): the one that ``ray.init`` has connected to, or a local one."""

    def compute(self, work: Sequence[Part]) -> Iterator[tuple[int, Table]]:
        """The number of each part and its rows, in the order in which they are finished."""
        import ray

        if not ray.is_initialized():
            ray.init()
        # A worker that dies is an error of the system, which Ray repeats.
        remote = ray.remote(max_retries=RETRIES)(_compute)
        waiting = {remote.remote(part): number for number, part in enumerate(work)}
        while waiting:
            done, _ = ray.wait(list(waiting), num_returns=1)
            for reference in done:
                yield waiting.pop(reference), ray.get(reference)


class Dask(Engine):
    """A Dask cluster (``pip install sonarfix[dask]``): that of a ``client``, or the current one."""

    def __init__(self, client: Any = None) -> None:
        self._client = client

    def compute(self, work: Sequence[Part]) -> Iterator[tuple[int, Table]]:
        """The number of each part and its rows, in the order in which they are finished."""
        import distributed

        client = self._client or distributed.get_client()
        # Not pure: two equal parts would otherwise be one task.
        futures = client.map(_compute, list(work), retries=RETRIES, pure=False)
        numbers = {future.key: number for number, future in enumerate(futures)}
        for future in distributed.as_completed(futures):
            yield numbers[future.key], future.result()
            future.release()


def monte_carlo(
    scenario: Scenario,
    runs: int | None = None,
    seed: int | None = None,
    *,
    engine: Engine | None = None,
    size: int = PART,
    progress: Progress | None = None,
    **options: Any,
) -> Table:
    """The rows of Scenario.monte_carlo, in the order of the seeds, computed by an engine, by default Processes()."""
    work = parts(scenario, runs, seed, size=size, **options)
    tables: list[Table | None] = [None] * len(work)
    for number, table in (engine or Processes()).compute(work):
        tables[number] = table
        if progress:
            progress(work[number].runs)
    return Table.concat([table for table in tables if table is not None])


StrPath = Union[str, "os.PathLike[str]"]
"""The path of a file or a folder."""


def to_parquet(
    scenario: Scenario,
    folder: StrPath,
    runs: int | None = None,
    seed: int | None = None,
    *,
    engine: Engine | None = None,
    size: int = PART,
    progress: Progress | None = None,
    **options: Any,
) -> Path:
    """Writes the rows into a folder of Parquet files, one a part, as the parts are finished; returns the folder.

    ``scenario``, ``runs``, ``seed``, ``engine``, ``size``, ``progress`` and ``options`` are those of monte_carlo. A part whose file
    exists is not computed again, so that an interrupted call is resumed; a folder of other runs raises InputError. Read the
    rows back with ``duckdb.sql("from 'folder/*.parquet' order by seed")`` or ``polars.scan_parquet("folder")``.
    """
    work = parts(scenario, runs, seed, size=size, **options)
    folder = _folder(folder, f"{scenario.rows_plan(runs, seed)}, size {size}, {sorted(options)}\n")
    missing = [part for part in work if not _file(folder, part).exists()]
    for number, table in (engine or Processes()).compute(missing):
        _write(table, _file(folder, missing[number]))
        if progress:
            progress(missing[number].runs)
    return folder


def _folder(folder: StrPath, plan: str) -> Path:
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    note = folder / "plan.txt"
    if not note.exists():
        note.write_text(plan, encoding="utf-8")
    elif note.read_text(encoding="utf-8") != plan:
        raise InputError(f"{folder} holds other runs: delete it, or name another folder")
    return folder


def _file(folder: Path, part: Part) -> Path:
    return folder / f"seed-{part.seed:020}.parquet"


def _write(table: Table, file: Path) -> None:
    import pyarrow
    import pyarrow.parquet

    growing = file.with_suffix(".growing")
    pyarrow.parquet.write_table(pyarrow.table(table), growing)
    growing.replace(file)


def sweep(
    scenario: Scenario,
    keys: Mapping[str, Iterable[Any]],
    runs: int | None = None,
    seed: int | None = None,
    *,
    engine: Engine | None = None,
    size: int = PART,
    progress: Progress | None = None,
    **options: Any,
) -> list[tuple[dict[str, Any], Table]]:
    """All combinations of values of keys, each with the rows of its runs; the last key changes fastest, as in ``run --sweep``.

    ``keys`` are those of Scenario, for example ``{"sonar.noise": ["2 mm", "5 mm"], "truth.scale_right": [0.0, 0.02]}``.
    """
    points = [dict(zip(keys, values)) for values in itertools.product(*keys.values())]
    work = [parts(scenario.replace(point), runs, seed, size=size, **options) for point in points]
    flat = list(itertools.chain.from_iterable(work))
    tables: list[Table | None] = [None] * len(flat)
    for number, table in (engine or Processes()).compute(flat):
        tables[number] = table
        if progress:
            progress(flat[number].runs)
    found = iter([table for table in tables if table is not None])
    return [(point, Table.concat(list(itertools.islice(found, len(of_point))))) for point, of_point in zip(points, work)]
