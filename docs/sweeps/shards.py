#!/usr/bin/env python3
"""The shards of a large number of runs on a Ray cluster, or on the cores of this machine.

    pip install ray
    python shards.py classroom.toml --runs 1000000 --shards 64 --folder rows

The folder must be one that all nodes see. A shard whose node fails is computed elsewhere, from its last written row on. The script
ends with the statistics of all runs (`sonarfix merge`). Further options are passed to `sonarfix run`, for example
`--seed 5 --policy nearest`.
"""

import argparse
import os
import pathlib
import subprocess

import ray


@ray.remote(num_cpus=1, max_retries=3)
def compute(command):
    """Computes a shard on one core."""
    # Without the output: every shard prints its own statistics.
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=os.environ | {"RAYON_NUM_THREADS": "1"})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", type=pathlib.Path)
    parser.add_argument("--runs", type=int, required=True)
    parser.add_argument("--shards", type=int, required=True)
    parser.add_argument("--folder", type=pathlib.Path, required=True)
    parser.add_argument("--sonarfix", default="sonarfix", help="the program, on every node")
    arguments, further = parser.parse_known_args()

    folder = arguments.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    ray.init()
    files, tasks = [], []
    for shard in range(1, arguments.shards + 1):
        files.append(str(folder / f"shard-{shard}.csv"))
        command = [arguments.sonarfix, "run", str(arguments.scenario.resolve()), "--runs", str(arguments.runs)]
        command += ["--shard", f"{shard}/{arguments.shards}", "--rows", files[-1], *further]
        tasks.append(compute.remote(command))
    ray.get(tasks)
    subprocess.run([arguments.sonarfix, "merge", *files], check=True)


if __name__ == "__main__":
    main()
