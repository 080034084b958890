#!/usr/bin/env python3
"""Simulate a driven Furuta pendulum and evaluate two criteria, with mops and with a method compiled by numba.

    pip install numba
    cargo build --release
    python3 benches/peers/simulation_beside_numba.py target/release/mops

numba: DOPRI5 (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993) with dense output, the tolerances of
mops. Criteria of the angle of the pendulum over 3 s: the largest absolute value, at steps and where the rate is zero, and the
integral of the square, by Gauss's rule with five nodes per step. mops: the compiled model `furuta`, and equations from text;
differential evolution over both friction coefficients, so that its time contains the solver and the record of evaluations; its
start and its report are those of a shorter search, subtracted. Both in processor time.
"""

import argparse
import json
import math
import resource
import subprocess
import tempfile
import time
from pathlib import Path

import numpy
from numba import njit

LONG, SHORT = 20_400, 400
RELATIVE, ABSOLUTE, END = 1e-6, 1e-8, 3.0
PHYSICAL = {"a": 0.0044, "b": 0.0118, "c": 0.0036, "d": 0.105}
FRICTION = {"ba": (0.0005, 0.004), "bp": (0.0001, 0.0006)}

COMPILED = """
[models.rig]
furuta = { OPTIONS }
[models.rig.parameters]
PHYSICAL
theta0 = 1.68
dtheta0 = 1.78
"""

TEXT = """
[models.rig.equations]
OPTIONS
states = { phi = "rad", dphi = "rad/s", theta = "rad", dtheta = "rad/s" }
inputs = { u = "N m" }
parameters = { ba = "N m s", bp = "N m s" }
start = { theta = 1.68, dtheta = 1.78 }
[models.rig.equations.constants]
PHYSICAL
[models.rig.equations.let]
s = "sin(theta)"
q = "cos(theta)"
m11 = "b + a*s^2"
m12 = "c*q"
arm = "c*dtheta^2*s - 2*a*dtheta*dphi*s*q - ba*dphi + u"
pendulum = "a*dphi^2*s*q + d*s - bp*dtheta"
det = "m11*a - m12^2"
[models.rig.equations.der]
phi = "dphi"
dphi = "(a*arm - m12*pendulum)/det"
theta = "dtheta"
dtheta = "(m11*pendulum - m12*arm)/det"
"""

OPTIONS = 'horizon = "3 s", tolerance = { relative = 1e-6, absolute = 1e-8 }'

TASK = """
[cases.driven]
inputs.u.sine = { amplitude = 0.05, frequency = 0.6366197723675814 }
[criteria]
peak = { peak = { signal = "theta", of = "absolute" }, demand = 1 }
square = { ise = { signal = "theta", target = 0 }, demand = 1 }
[solver.differential-evolution]
polish = false
[tuners]
"""


@njit
def derivative(t, x, p, dx):
    """Set the derivatives of phi, phi', theta, theta'."""
    s, q = math.sin(x[2]), math.cos(x[2])
    m11, m12 = p[1] + p[0] * s * s, p[2] * q
    arm = p[2] * x[3] * x[3] * s - 2 * p[0] * x[3] * x[1] * s * q - p[4] * x[1] + 0.05 * math.sin(4 * t)
    pendulum = p[0] * x[1] * x[1] * s * q + p[3] * s - p[5] * x[3]
    det = m11 * p[0] - m12 * m12
    dx[0], dx[1] = x[1], (p[0] * arm - m12 * pendulum) / det
    dx[2], dx[3] = x[3], (m11 * pendulum - m12 * arm) / det


@njit
def dense(c, u):
    """Return the dense output at the fraction u of a step."""
    return c[0] + u * (c[1] + (1 - u) * (c[2] + u * (c[3] + (1 - u) * c[4])))


@njit
def simulate(p, nodes, weights):
    """Return the largest absolute angle of the pendulum and the integral of its square."""
    x, y, e = numpy.array([0.0, 0.0, 1.68, 1.78]), numpy.empty(4), numpy.empty(4)
    k, c, r = numpy.empty((7, 4)), numpy.empty(5), numpy.empty(5)
    t, h, last, rejected = 0.0, 0.01, 1e-4, False
    derivative(t, x, p, k[0])
    peak, square = abs(x[2]), 0.0
    while t < END:
        ends = t + 1.01 * h >= END
        if ends:
            h = END - t
        for j in range(4):
            y[j] = x[j] + h * k[0, j] / 5
        derivative(t + h / 5, y, p, k[1])
        for j in range(4):
            y[j] = x[j] + h * (3 / 40 * k[0, j] + 9 / 40 * k[1, j])
        derivative(t + 0.3 * h, y, p, k[2])
        for j in range(4):
            y[j] = x[j] + h * (44 / 45 * k[0, j] - 56 / 15 * k[1, j] + 32 / 9 * k[2, j])
        derivative(t + 0.8 * h, y, p, k[3])
        for j in range(4):
            y[j] = x[j] + h * (
                19372 / 6561 * k[0, j] - 25360 / 2187 * k[1, j] + 64448 / 6561 * k[2, j] - 212 / 729 * k[3, j]
            )
        derivative(t + 8 / 9 * h, y, p, k[4])
        for j in range(4):
            y[j] = x[j] + h * (
                9017 / 3168 * k[0, j]
                - 355 / 33 * k[1, j]
                + 46732 / 5247 * k[2, j]
                + 49 / 176 * k[3, j]
                - 5103 / 18656 * k[4, j]
            )
        derivative(t + h, y, p, k[5])
        for j in range(4):
            y[j] = x[j] + h * (
                35 / 384 * k[0, j] + 500 / 1113 * k[2, j] + 125 / 192 * k[3, j] - 2187 / 6784 * k[4, j] + 11 / 84 * k[5, j]
            )
        derivative(t + h, y, p, k[6])
        norm = 0.0
        for j in range(4):
            e[j] = h * (
                71 / 57600 * k[0, j]
                - 71 / 16695 * k[2, j]
                + 71 / 1920 * k[3, j]
                - 17253 / 339200 * k[4, j]
                + 22 / 525 * k[5, j]
                - k[6, j] / 40
            )
            norm += (e[j] / (ABSOLUTE + RELATIVE * max(abs(x[j]), abs(y[j])))) ** 2
        norm = math.sqrt(norm / 4)
        growth = norm**0.17
        if norm > 1:
            h /= min(5.0, growth / 0.9)
            rejected = True
            continue
        # Coefficients of the dense output of theta and of its rate.
        for j, into in ((2, c), (3, r)):
            into[0], into[1] = x[j], y[j] - x[j]
            into[2] = h * k[0, j] - into[1]
            into[3] = into[1] - h * k[6, j] - into[2]
            into[4] = h * (
                -12715105075 / 11282082432 * k[0, j]
                + 87487479700 / 32700410799 * k[2, j]
                - 10690763975 / 1880347072 * k[3, j]
                + 701980252875 / 199316789632 * k[4, j]
                - 1453857185 / 822651844 * k[5, j]
                + 69997945 / 29380423 * k[6, j]
            )
        for i in range(nodes.size):
            square += h * weights[i] * dense(c, nodes[i]) ** 2
        peak = max(peak, abs(y[2]))
        if x[3] * y[3] < 0:
            low, high = 0.0, 1.0
            for _ in range(40):
                middle = (low + high) / 2
                if dense(r, middle) * x[3] > 0:
                    low = middle
                else:
                    high = middle
            peak = max(peak, abs(dense(c, low)))
        t = END if ends else t + h
        x[:], k[0, :] = y, k[6]
        shrink = min(max(growth / last**0.04 / 0.9, 0.1), 5.0)
        h /= max(shrink, 1.0) if rejected else shrink
        last, rejected = max(norm, 1e-4), False
    return peak, square


def run_numba(points):
    """Return processor time per simulation, and the criteria at the points."""
    nodes, weights = numpy.polynomial.legendre.leggauss(5)
    nodes, weights = (nodes + 1) / 2, weights / 2
    rows = [numpy.array([*PHYSICAL.values(), *point]) for point in points]
    simulate(rows[0], nodes, weights)
    before = time.process_time()
    found = [simulate(row, nodes, weights) for row in rows]
    return (time.process_time() - before) / len(rows), numpy.array(found)


def run_mops(program, model, folder, evaluations):
    """Return processor time, and the values of the result."""
    options = OPTIONS if "furuta" in model else OPTIONS.replace('s", ', 's"\n')
    physical = "\n".join(f"{name} = {value}" for name, value in PHYSICAL.items())
    text = '[study]\nname = "pendulum"\n' + model.replace("PHYSICAL", physical).replace("OPTIONS", options) + TASK
    for name, (low, high) in FRICTION.items():
        text += f"{name} = {{ start = {(low + high) / 2}, min = {low}, max = {high} }}\n"
    (folder / "study.toml").write_text(text)
    command = [program, "run", folder / "study.toml", "--solver", "differential-evolution", "--out", folder / "out"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([*command, "--max-evaluations", str(evaluations)], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = json.loads((folder / "out" / "result.json").read_text())
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, result


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mops", help="program mops")
    program = parser.parse_args().mops
    random = numpy.random.default_rng(1)
    low, high = numpy.array(list(FRICTION.values())).T
    numba = min(run_numba(random.uniform(low, high, (LONG - SHORT, 2)))[0] for _ in range(5))
    print(f"numba                  {1e6 * numba:6.1f} us")
    with tempfile.TemporaryDirectory() as folder:
        for name, model in [("model furuta", COMPILED), ("equations from text", TEXT)]:
            times = []
            for _ in range(3):
                short, _ = run_mops(program, model, Path(folder), SHORT)
                long, result = run_mops(program, model, Path(folder), LONG)
                times.append((long - short) / (LONG - SHORT))
            print(f"mops, {name:20} {1e6 * min(times):6.1f} us, ratio {min(times) / numba:.2f}, {result['evaluations']} evaluations")
            point = [next(t["value"] for t in result["tuners"] if t["name"] == n) for n in FRICTION]
            print("  criteria of mops and numba:", [c["value"] for c in result["criteria"]], run_numba([point])[1][0])


if __name__ == "__main__":
    main()
