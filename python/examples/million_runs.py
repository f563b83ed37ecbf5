"""Many runs over processes, into Parquet: the measured rate, and how many cores 10⁶ runs in an hour need."""

import math
import os
import sys
import tempfile
import time
from pathlib import Path

import sonarfix as sf
from sonarfix import distributed

MILLION = 1_000_000


def main(runs: int = 2_000) -> None:
    cores = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder:
        paper, engine = sf.Scenario("paper"), distributed.Processes(cores)
        start = time.perf_counter()
        rows = distributed.to_parquet(paper, Path(folder) / "rows", runs, engine=engine, size=250)
        seconds = time.perf_counter() - start
        files = len(list(rows.glob("*.parquet")))
    rate = runs / seconds / cores
    print(f"{runs} runs in {seconds:.1f} s on {cores} cores, {files} files: {rate:.0f} runs per second and core")
    print(f"10^6 runs in an hour need {math.ceil(MILLION / rate / 3600)} cores")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
