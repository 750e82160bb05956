# The design of experiments of the reduced model: one job per share, then a check that no path is missing.
#
#   snakemake --snakefile offline/cli/cluster/design.Snakefile --cores 8 --config runs=/scratch/runs shares=8
#
# runs: folder of the models, the runs go to runs/ in it; shares: number of shares; fingerpad: the program (default: found in PATH); options: more
# options of `fingerpad finger`, one string, the same for every share; jobs: threads of each share.
# A share that was killed goes on, when the workflow is started again, with the paths that it had not finished.
# On a cluster give snakemake an executor, e.g. --executor slurm --jobs 50.
from pathlib import Path

RUNS = Path(config.get("runs", "runs"))
SHARES = int(config.get("shares", 8))
PROGRAM = config.get("fingerpad", "fingerpad")
OPTIONS = config.get("options", "")
DONE = Path(f"{RUNS}.done")
if SHARES < 1:
    raise WorkflowError(f"shares={SHARES}: at least one share is needed")


rule all:
    input:
        DONE / "complete.txt",


rule share:
    output:
        touch(DONE / "{index}_of_{of}"),
    threads: int(config.get("jobs", 1))
    shell:
        "{PROGRAM:q} finger --design full --out {RUNS:q} --task {wildcards.index}/{wildcards.of} --jobs {threads} {OPTIONS}"


rule complete:
    input:
        [DONE / f"{k}_of_{SHARES}" for k in range(1, SHARES + 1)],
    output:
        DONE / "complete.txt",
    shell:
        "{PROGRAM:q} finger --design full --out {RUNS:q} --check {OPTIONS} > {output:q}"
