"""Normal numbers that are a function of seed, name and time: nothing is remembered, nothing depends on the steps.

Philox 4x64-10 with the key (seed, a number of the name) encrypts the counter (time in ns, attempt, 0, 0); of its answer
the first two words give u, v, uniform in [-1, 1), and with s = u^2 + v^2, where 0 < s < 1,

    z = u sqrt(-2 ln(s) / s)                                                                              (1)

is standard normal; else the next attempt is made. The logarithm is summed here (2), so that Python and the kernel
(faults.h) give the same bits on every platform: m in [sqrt(1/2), sqrt(2)), w = (m - 1) / (m + 1),

    ln(m 2^e) = 2 w (1 + w^2 / 3 + w^4 / 5 + ...) + e ln 2                                                (2)

Source: J. Salmon, M. Moraes, R. Dror, D. Shaw, Parallel random numbers: as easy as 1, 2, 3, SC'11 (2011), for Philox;
G. Marsaglia, T. Bray, A convenient method for generating normal variables, SIAM Review 6 (1964), for (1).
Limits: times nearer than 0.5 ns are one.
"""

import hashlib
import math

MASK = (1 << 64) - 1
MULTIPLIERS = 0xD2E7470EE14C6C93, 0xCA5A826395121157
WEYL = 0x9E3779B97F4A7C15, 0xBB67AE8584CAA73B
ROUNDS = 10

TERMS = 12
"""Of (2): w^2 is below 0.03, so that the first term left out is below 1e-19."""

LN2 = 0.6931471805599453
SQRT_HALF = 0.7071067811865476


def key_of(name: str) -> int:
    """Return the number of a name, 64 bits."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "little")


def philox(counter: tuple[int, int, int, int], key: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return four words of 64 bits for a counter and a key of such words."""
    a, b, c, d = counter
    k, m = key
    for _ in range(ROUNDS):
        p, q = MULTIPLIERS[0] * a, MULTIPLIERS[1] * c
        a, b, c, d = (q >> 64) ^ b ^ k, q & MASK, (p >> 64) ^ d ^ m, p & MASK
        k, m = (k + WEYL[0]) & MASK, (m + WEYL[1]) & MASK
    return a, b, c, d


def normal(seed: int, key: int, t: float) -> float:
    """Return the standard normal number of a seed, a name's key, a time in s."""
    time, attempt = round(t * 1e9) & MASK, 0
    while True:
        x, y, *_ = philox((time, attempt, 0, 0), (seed, key))
        u, v = 2.0 * _uniform(x) - 1.0, 2.0 * _uniform(y) - 1.0
        s = u * u + v * v
        if 0.0 < s < 1.0:
            return u * math.sqrt(-2.0 * _log(s) / s)  # (1)
        attempt += 1


def _uniform(word: int) -> float:
    """Return the upper 53 bits of a word as a number in [0, 1)."""
    return float(word >> 11) * 2.0**-53


def _log(x: float) -> float:
    m, e = math.frexp(x)
    if m < SQRT_HALF:
        m, e = 2.0 * m, e - 1
    w = (m - 1.0) / (m + 1.0)
    total = 0.0
    for i in range(TERMS - 1, -1, -1):
        total = total * (w * w) + 1.0 / float(2 * i + 1)
    return 2.0 * w * total + float(e) * LN2  # (2)
