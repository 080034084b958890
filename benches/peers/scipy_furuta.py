"""Simulate `benches/simulation.rs` with SciPy, for comparison; requires `pip install scipy`."""

import math
import time

from scipy.integrate import solve_ivp

A, B, C, D, BA, BP = 0.0044, 0.0118, 0.0036, 0.105, 0.002, 0.0003


def derivative(t, x):
    """Return the right-hand side; states phi, phi', theta, theta'; the torque on the arm is 0.05 sin 4t N m."""
    _, v, theta, w = x
    s, c = math.sin(theta), math.cos(theta)
    m11, m12 = B + A * s * s, C * c
    arm = C * w * w * s - 2 * A * w * v * s * c - BA * v + 0.05 * math.sin(4 * t)
    pendulum = A * v * v * s * c + D * s - BP * w
    det = m11 * A - m12 * m12
    return [v, (A * arm - m12 * pendulum) / det, w, (m11 * pendulum - m12 * arm) / det]


def main():
    for method in ["RK45", "LSODA", "DOP853"]:
        times = []
        for _ in range(20):
            start = time.perf_counter()
            done = solve_ivp(derivative, (0, 3), [0, 0, 1.68, 1.78], method=method, rtol=1e-6, atol=1e-8)
            times.append(time.perf_counter() - start)
        times.sort()
        end = ", ".join(f"{x:.9f}" for x in done.y[:, -1])
        print(f"{method:7} {1e6 * times[len(times) // 2]:9.1f} us, {done.nfev:5} derivatives, end {end}")


if __name__ == "__main__":
    main()
