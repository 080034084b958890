#!/usr/bin/env python3
"""Compare the processor times of NSGA-II in mops, pymoo and pagmo2 on ZDT1 (100 members, 250 generations).

    pip install pymoo pygmo
    cargo build --release -p mops-bench
    python3 benches/peers/nsga2_beside_others.py target/release/mops-bench

pymoo: J. Blank, K. Deb, pymoo: Multi-Objective Optimization in Python, IEEE Access 8 (2020) 89497. pagmo2: F. Biscani, D. Izzo,
Journal of Open Source Software 5 (2020) 2338.
"""

import argparse
import json
import resource
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy
import pygmo
import pymoo
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.indicators.hv import HV
from pymoo.optimize import minimize
from pymoo.problems import get_problem

MEMBERS, GENERATIONS = 100, 250


def of_children():
    """Return the processor time of the child processes that have ended, s."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def of_mops(program, problem, seeds):
    """Return the means of processor time, hypervolume and evaluations per run; the time is of the whole process."""
    with tempfile.TemporaryDirectory() as folder:
        before = of_children()
        command = [program, "zdt", "--problems", problem, "--solver", "nsga2", "--quiet"]
        subprocess.run(
            command + ["--seeds", str(seeds), "--jobs", "1", "--out", folder], check=True, stdout=subprocess.DEVNULL
        )
        seconds = (of_children() - before) / seeds
        rows = json.loads((Path(folder) / "results.json").read_text())["rows"]
    volumes = [row["front"]["hypervolume"] for row in rows]
    return seconds, statistics.mean(volumes), statistics.mean(row["evaluations"] for row in rows)


def of_pymoo(problem, seeds):
    """Return the means for pymoo; the time excludes the import and the hypervolume."""
    volume = HV(ref_point=numpy.array([1.1, 1.1]))
    seconds, volumes = [], []
    for seed in range(1, seeds + 1):
        before = time.process_time()
        found = minimize(get_problem(problem.lower()), NSGA2(pop_size=MEMBERS), ("n_gen", GENERATIONS), seed=seed)
        seconds.append(time.process_time() - before)
        volumes.append(volume(found.F))
    return statistics.mean(seconds), statistics.mean(volumes), MEMBERS * GENERATIONS


def of_pagmo(problem, seeds):
    """Return the means for pagmo2, whose number of members is a multiple of 4; the time excludes import and hypervolume."""
    number = int(problem[-1])
    seconds, volumes = [], []
    for seed in range(1, seeds + 1):
        algorithm = pygmo.algorithm(pygmo.nsga2(gen=GENERATIONS - 1, seed=seed))
        before = time.process_time()
        population = pygmo.population(pygmo.zdt(number, param=10 if number in (4, 6) else 30), size=MEMBERS, seed=seed)
        population = algorithm.evolve(population)
        seconds.append(time.process_time() - before)
        points = population.get_f()
        volumes.append(pygmo.hypervolume(points[(points < 1.1).all(axis=1)]).compute([1.1, 1.1]))
    return statistics.mean(seconds), statistics.mean(volumes), MEMBERS * GENERATIONS


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mops", help="path of the release build")
    parser.add_argument("--problem", default="ZDT1", help="a problem of the suite zdt")
    parser.add_argument("--seeds", type=int, default=20, help="number of runs of each")
    arguments = parser.parse_args()
    rows = [
        ("mops", *of_mops(arguments.mops, arguments.problem, arguments.seeds)),
        (f"pymoo {pymoo.__version__}", *of_pymoo(arguments.problem, arguments.seeds)),
        (f"pagmo {pygmo.__version__}", *of_pagmo(arguments.problem, arguments.seeds)),
    ]
    print(f"{arguments.problem}, NSGA-II, {MEMBERS} members, {GENERATIONS} generations, mean of {arguments.seeds} seeds")
    print(f"{'':14}{'CPU s':>9}{'volume':>9}{'evaluations':>13}")
    for name, seconds, volume, evaluations in rows:
        print(f"{name:14}{seconds:9.3f}{volume:9.4f}{evaluations:13.0f}")
    for name, seconds, *_ in rows[1:]:
        print(f"mops takes {rows[0][1] / seconds:.2f} times the processor time of {name}")


if __name__ == "__main__":
    main()
