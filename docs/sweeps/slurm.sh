#!/usr/bin/env bash
# The shards of a large number of runs as a Slurm array, one shard per task:
#
#     sbatch --array=1-64 slurm.sh classroom.toml 1000000 rows
#
# A task that is killed or runs out of time is submitted again with its index (sbatch --array=7 …) and computes the missing rows only.
# Afterwards:
#
#     sonarfix merge rows/shard-*.csv --rows rows.parquet
#SBATCH --job-name=sonarfix
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=4
#SBATCH --mem=1G
#SBATCH --time=04:00:00
#SBATCH --requeue
set -euo pipefail

scenario=$1
runs=$2
folder=$3
shard=${SLURM_ARRAY_TASK_ID:?submit it with --array=1-M}
shards=${SLURM_ARRAY_TASK_MAX:?}
mkdir -p "$folder"
RAYON_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1} sonarfix run "$scenario" --runs "$runs" \
    --shard "$shard/$shards" --rows "$folder/shard-$shard.csv"
