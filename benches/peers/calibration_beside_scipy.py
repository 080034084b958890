#!/usr/bin/env python3
"""Calibrate twelve parameters of a drive with a flexible coupling, with mops and SciPy from the same initial guess.

    pip install scipy numba
    cargo build --release
    python3 benches/peers/calibration_beside_scipy.py target/release/mops

SciPy: `least_squares` (trust region reflective, derivatives by differences) in logarithms of the parameters, on a Runge-Kutta
method of fourth order compiled by numba, two steps per sample. The data are simulated by the same method with ten steps per
sample and noise of 0.005 rad. Processor times: of mops that of the whole process; of SciPy without import and compilation.
"""

import argparse
import json
import resource
import subprocess
import tempfile
import time
from pathlib import Path

import numpy
from numba import njit
from scipy.optimize import least_squares

SAMPLES, PERIOD, SAMPLES_PER_STEP, NOISE = 1001, 0.02, 25, 0.005
NAMES = ["J1", "J2", "k", "kc", "d", "b1", "b2", "q1", "q2", "G", "g0", "Ta"]
TRUE = numpy.array([0.02, 0.05, 3.0, 40.0, 0.02, 0.03, 0.01, 0.004, 0.002, 0.6, 0.05, 0.08])
START = numpy.array([0.01, 0.03, 1.5, 64.0, 0.01, 0.06, 0.005, 0.008, 0.0032, 0.96, 0.08, 0.16])

STUDY = """
[study]
name = "drive"
task = "calibration"
[models.drive.equations]
states = { th1 = "rad", w1 = "rad/s", th2 = "rad", w2 = "rad/s", ta = "1" }
inputs = { u = "1" }
parameters = { PARAMETERS }
let = { e = "th1 - th2", f = "k*e + kc*e^3 + d*(w1 - w2)" }
[models.drive.equations.der]
th1 = "w1"
w1 = "(ta - f - b1*w1 - q1*w1*abs(w1))/J1"
th2 = "w2"
w2 = "(f - b2*w2 - q2*w2*abs(w2) - g0*sin(th2))/J2"
ta = "(G*u - ta)/Ta"
[experiments.run]
file = "drive.csv"
inputs = { u = "u" }
channels = { th1 = { column = "th1", noise = NOISE, unit = "rad" }, th2 = { column = "th2", noise = NOISE, unit = "rad" } }
[criteria]
th1 = { normalised-error = { signal = "th1", noise = NOISE } }
th2 = { normalised-error = { signal = "th2", noise = NOISE } }
[tuners]
"""


@njit
def derivative(x, u, p, dx):
    """Set the derivatives of angle and speed of the motor and of the load, and of the torque."""
    twist = x[0] - x[2]
    coupling = p[2] * twist + p[3] * twist**3 + p[4] * (x[1] - x[3])
    dx[0] = x[1]
    dx[1] = (x[4] - coupling - p[5] * x[1] - p[7] * x[1] * abs(x[1])) / p[0]
    dx[2] = x[3]
    dx[3] = (coupling - p[6] * x[3] - p[8] * x[3] * abs(x[3]) - p[10] * numpy.sin(x[2])) / p[1]
    dx[4] = (p[9] * u - x[4]) / p[11]


@njit
def simulate(p, u, steps):
    """Return both angles at all samples; the input is held between samples."""
    x, trial = numpy.zeros(5), numpy.zeros(5)
    k = numpy.zeros((4, 5))
    angles = numpy.zeros((u.size, 2))
    h = PERIOD / steps
    for i in range(u.size - 1):
        for _ in range(steps):
            derivative(x, u[i], p, k[0])
            for stage, part in ((1, 0.5), (2, 0.5), (3, 1.0)):
                for j in range(5):
                    trial[j] = x[j] + part * h * k[stage - 1, j]
                derivative(trial, u[i], p, k[stage])
            for j in range(5):
                x[j] += h / 6 * (k[0, j] + 2 * k[1, j] + 2 * k[2, j] + k[3, j])
        angles[i + 1, 0], angles[i + 1, 1] = x[0], x[2]
    return angles


def data():
    """Return input and measured angles."""
    random = numpy.random.default_rng(8)
    u = numpy.repeat(random.uniform(-2, 2, SAMPLES // SAMPLES_PER_STEP + 1), SAMPLES_PER_STEP)[:SAMPLES]
    return u, simulate(TRUE, u, 10) + NOISE * random.standard_normal((SAMPLES, 2))


def run_mops(program, u, measured):
    """Return processor time, parameters, evaluations and simulations."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        rows = [f"{i * PERIOD:.2f},{u[i]},{a},{b}" for i, (a, b) in enumerate(measured)]
        (folder / "drive.csv").write_text("t [s],u,th1 [rad],th2 [rad]\n" + "\n".join(rows) + "\n")
        text = STUDY.replace("PARAMETERS", ", ".join(f'{name} = ""' for name in NAMES)).replace("NOISE", str(NOISE))
        for name, start in zip(NAMES, START):
            text += f'{name} = {{ start = {start}, min = {start / 40}, max = {start * 40}, scale = "log" }}\n'
        (folder / "study.toml").write_text(text)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [program, "run", folder / "study.toml", "--out", folder / "out"], check=True, stdout=subprocess.DEVNULL
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        result = json.loads((folder / "out" / "result.json").read_text())
    values = numpy.array([next(t["value"] for t in result["tuners"] if t["name"] == name) for name in NAMES])
    return seconds, values, result["evaluations"], result["simulations"]


def run_scipy(u, measured):
    """Return processor time, parameters, evaluations and simulations."""
    simulations = 0

    def residuals(logarithms):
        nonlocal simulations
        simulations += 1
        angles = simulate(numpy.exp(logarithms), u, 2)
        return numpy.nan_to_num((angles - measured) / NOISE, nan=1e6, posinf=1e6, neginf=-1e6).ravel()

    residuals(numpy.log(START))
    simulations = 0
    before = time.process_time()
    bounds = (numpy.log(START / 40), numpy.log(START * 40))
    found = least_squares(residuals, numpy.log(START), bounds=bounds, method="trf", max_nfev=1000)
    return time.process_time() - before, numpy.exp(found.x), found.nfev, simulations


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mops", help="program mops")
    u, measured = data()
    print("            processor s  evaluations  simulations  residual / noise")
    seconds = {}
    program = parser.parse_args().mops
    for name, run in [("mops", lambda: run_mops(program, u, measured)), ("SciPy", lambda: run_scipy(u, measured))]:
        # The least of three runs.
        seconds[name], values, evaluations, simulations = min((run() for _ in range(3)), key=lambda found: found[0])
        residual = (simulate(values, u, 10) - measured) / NOISE
        print(f"{name:10}  {seconds[name]:11.3f}  {evaluations:11}  {simulations:11}  {numpy.sqrt((residual**2).mean()):16.6f}")
    print(f"mops takes {seconds['mops'] / seconds['SciPy']:.2f} times the processor time of SciPy.")


if __name__ == "__main__":
    main()
