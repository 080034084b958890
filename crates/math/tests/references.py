"""Writes references.csv: values of the functions of mops-math, by mpmath with 60 digits.

A line is: function, first argument, second argument or nothing, nearest f64, and how far the exact value lies from it in units
in the last place. Run: python3 references.py > references.csv
"""
import math
import random

import mpmath
from mpmath import mp, mpf

mp.dps = 60
random.seed(1)


def plain(low, high):
    return lambda: random.uniform(low, high)


def size(low, high, signs=(1, -1)):
    return lambda: random.choice(signs) * 10 ** random.uniform(low, high)


def mixed(*draws):
    return lambda: random.choice(draws)()


ANGLES = mixed(plain(-7, 7), size(-9, 0), size(1, 5), size(5, 22))
UNIT = mixed(plain(-1, 1), size(-9, 0), lambda: random.choice((1, -1)) * (1 - 10 ** random.uniform(-12, -1)))
ALL = mixed(plain(-10, 10), size(-12, 12), size(-300, 300))
POSITIVE = mixed(plain(0, 10), size(-12, 12, (1,)), size(-300, 300, (1,)), lambda: 1 + size(-9, -1)())

FUNCTIONS = {
    "sin": (mpmath.sin, ANGLES),
    "cos": (mpmath.cos, ANGLES),
    "tan": (mpmath.tan, ANGLES),
    "asin": (mpmath.asin, UNIT),
    "acos": (mpmath.acos, UNIT),
    "atan": (mpmath.atan, ALL),
    "sinh": (mpmath.sinh, mixed(plain(-5, 5), size(-9, 0), plain(-700, 700))),
    "cosh": (mpmath.cosh, mixed(plain(-5, 5), size(-9, 0), plain(-700, 700))),
    "tanh": (mpmath.tanh, mixed(plain(-5, 5), size(-9, 0), plain(-25, 25))),
    "asinh": (mpmath.asinh, ALL),
    "acosh": (mpmath.acosh, mixed(lambda: 1 + size(-9, 0, (1,))(), size(0, 300, (1,)))),
    "atanh": (mpmath.atanh, UNIT),
    "exp": (mpmath.exp, mixed(plain(-5, 5), size(-9, 0), plain(-740, 709))),
    "exp2": (lambda x: mpf(2) ** x, mixed(plain(-5, 5), size(-9, 0), plain(-1070, 1023))),
    "exp_m1": (mpmath.expm1, mixed(plain(-5, 5), size(-9, 0), plain(-40, 709))),
    "ln": (mpmath.log, POSITIVE),
    "ln_1p": (mpmath.log1p, mixed(plain(-0.999, 5), size(-12, -1), size(0, 300, (1,)))),
    "log2": (lambda x: mpmath.log(x) / mpmath.log(2), POSITIVE),
    "log10": (mpmath.log10, POSITIVE),
    "cbrt": (lambda x: mpmath.sign(x) * mpmath.cbrt(abs(x)), ALL),
    "erfc": (mpmath.erfc, mixed(plain(-3, 6), size(-9, 0), plain(-6, 26))),
    "atan2": (mpmath.atan2, mixed(plain(-3, 3), size(-6, 6)), mixed(plain(-3, 3), size(-6, 6))),
    "hypot": (mpmath.hypot, size(-5, 5), size(-5, 5)),
    "powf": (mpmath.power, mixed(plain(0, 3), size(-5, 5, (1,))), mixed(plain(-3, 3), plain(-40, 40))),
}


def line(name, exact, arguments):
    nearest = float(exact)
    if nearest == 0 or math.isinf(nearest):
        return None
    off = float((exact - mpf(nearest)) / mpf(math.ulp(nearest)))
    texts = [repr(x) for x in arguments] + [""] * (2 - len(arguments))
    return f"{name},{texts[0]},{texts[1]},{nearest!r},{off:.3f}"


for name, (function, *draws) in FUNCTIONS.items():
    lines = []
    while len(lines) < 250:
        # Five digits are as good as seventeen, and shorter.
        arguments = [float(f"{draw():.5g}") for draw in draws]
        if name in ("asin", "acos", "atanh", "acosh", "ln", "ln_1p"):
            arguments = [draw() for draw in draws] if random.random() < 0.3 else arguments
        if name == "atanh" and abs(arguments[0]) >= 1:
            continue
        lines.append(line(name, function(*map(mpf, arguments)), arguments))
        if lines[-1] is None:
            lines.pop()
    print("\n".join(lines))
