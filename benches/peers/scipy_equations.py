"""Simulate `benches/equations.rs` with SciPy, for comparison; requires `pip install scipy`.

Python compiles the equations from text once, as mops does."""

import math
import time

from scipy.integrate import solve_ivp

TEXT = """
s, k = sin(th), cos(th)
m12, m22 = c*k, b + a*s*s
f1 = a*phd*phd*s*k + d*s - bp*thd
f2 = c*thd*thd*s - 2*a*thd*phd*s*k + u - ba*phd
det = a*m22 - m12*m12
"""
CODE = compile(TEXT, "equations", "exec")
VALUES = {"a": 0.0044, "b": 0.0075, "c": 0.0036, "d": 0.21, "ba": 9e-4, "bp": 2e-4, "sin": math.sin, "cos": math.cos}


def derivative(torque):
    """Return the right-hand side from text; states th, th', ph, ph'."""

    def f(t, x):
        th, thd, ph, phd = x
        names = {"th": th, "thd": thd, "ph": ph, "phd": phd, "u": torque(t)}
        exec(CODE, VALUES, names)
        f1, f2, m12, m22, det = (names[k] for k in ["f1", "f2", "m12", "m22", "det"])
        return [thd, (m22 * f1 - m12 * f2) / det, phd, (VALUES["a"] * f2 - m12 * f1) / det]

    return f


def by_hand(torque):
    """Return the right-hand side as a Python function."""
    a, b, c, d, ba, bp = (VALUES[k] for k in ["a", "b", "c", "d", "ba", "bp"])

    def f(t, x):
        th, thd, ph, phd = x
        s, k = math.sin(th), math.cos(th)
        m12, m22 = c * k, b + a * s * s
        f1 = a * phd * phd * s * k + d * s - bp * thd
        f2 = c * thd * thd * s - 2 * a * thd * phd * s * k + torque(t) - ba * phd
        det = a * m22 - m12 * m12
        return [thd, (m22 * f1 - m12 * f2) / det, phd, (a * f2 - m12 * f1) / det]

    return f


def main():
    for what, torque in [("driven by a sine", lambda t: 0.05 * math.sin(4 * t)), ("free", lambda t: 0.0)]:
        for kind, f in [("text", derivative(torque)), ("function", by_hand(torque))]:
            times = []
            for _ in range(10):
                start = time.perf_counter()
                done = solve_ivp(f, (0, 3), [2.0, 0, 0.3, 0], method="RK45", rtol=1e-6, atol=1e-8)
                times.append(time.perf_counter() - start)
            times.sort()
            print(f"{what:18} {kind:9} {1e6 * times[5]:9.1f} us, {done.nfev} derivatives, th {done.y[0, -1]:.9f}")


if __name__ == "__main__":
    main()
