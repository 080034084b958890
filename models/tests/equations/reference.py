"""Reference values for tests/equations: the same plants integrated by SciPy's DOP853 (rtol 1e-12, atol 1e-13). The equations
are solved for the derivatives by hand or by numpy.linalg.solve. Run with SciPy 1.17."""

import numpy as np
from scipy.integrate import solve_ivp


def furuta(p):
    a, b, c, d, bp, ba = (p[k] for k in ["a", "b", "c", "d", "bp", "ba"])

    def f(t, x):
        th, thd, ph, phd = x
        s, k = np.sin(th), np.cos(th)
        mass = np.array([[a, c * k], [c * k, b + a * s * s]])
        force = np.array([a * phd**2 * s * k + d * s - bp * thd,
                          c * thd**2 * s - 2 * a * thd * phd * s * k + 0.05 * np.sin(4 * t) - ba * phd])
        acc = np.linalg.solve(mass, force)
        return [thd, acc[0], phd, acc[1]]
    return f


def tanks(kp, a1, a2):
    def f(t, h):
        q1, q2 = (a * np.sqrt(2 * 981 * max(x, 0)) for a, x in [(a1, h[0]), (a2, h[1])])
        u = 5 + 2 * np.sin(0.1 * t)
        return [(kp * u - q1) / 95, (q1 - q2) / 120]
    return f


CASES = {
    "furuta-free": (furuta(dict(a=0.0044, b=0.0075, c=0.0036, d=0.21, bp=2e-4, ba=9e-4)), [2.0, 0.0, 0.3, 0.0], 3.0),
    "furuta-driven": (furuta(dict(a=0.00614, b=0.0118, c=0.00233, d=0.137, bp=5e-4, ba=1.5e-3)), [3.2, 0.5, 0.0, -1.0], 3.0),
    "servo": (lambda t, x: [x[1], (0.052 * 2 * np.sin(3 * t) - 7e-4 * x[1]) / 2.8e-3], [0.2, -1.0], 4.0),
    "spring": (lambda t, x: [x[1], (3 * np.sin(10 * t) - 0.64 * x[1] - 127 * x[0]) / 0.8], [0.01, 0.5], 3.0),
    "tanks": (tanks(19.5, 1.12, 0.468), [8.9, 8.0], 120.0),
    "pendulum": (lambda t, x: [x[1], -9.81 / 0.444 * np.sin(x[0]) - 0.138 * x[1]], [1.1, 0.0], 5.0),
    "pendulum-height": (lambda t, x: [x[1], -9.81 / 0.2 * np.sin(x[0]) - 0.204 * x[1]], [0.9, 0.3], 5.0),
    "axis": (lambda t, x: [x[1], (5 * np.sin(2 * t) - 5.92 * x[1]) / 1.48], [0.0, 0.1], 4.0),
    "ball": (lambda t, x: [x[1], -9.81 - 0.0944 * x[1]], [1.2, 8.5], 1.5),
    "room": (lambda t, x: [((5 + 3 * np.sin(7e-5 * t) - x[0]) / 5.89 + 0.484 * 1.5) / 1320], [18.0], 86400.0),
}

for name, (f, x0, end) in CASES.items():
    method = solve_ivp(f, (0, end), x0, method="DOP853", rtol=1e-12, atol=1e-13)
    print(f'("{name}", &{[float(f"{v:.11g}") for v in method.y[:, -1]]}),')
