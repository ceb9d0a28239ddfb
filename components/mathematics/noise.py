"""Repeatable noise: numbers that look random and are functions of counter, seed and channel.

    x <- (x + k_i)^3 mod m,  m = 67108859 prime, 3 does not divide m - 1: a permutation of 0..m-1 (1)
    x = 0; x <- (1) with k = counter, seed, channel, then three constants; u = (x + 1/2)/m        (2)
    normal: sqrt(-2 ln u_1) cos(2 pi u_2), u_1 and u_2 of two channels                            (3)
    white noise of one-sided amplitude density a, sampled every T: deviation a / sqrt(2 T)        (4)

k_i are taken mod m, 0..m-1 for negative ones too. All products are below 2^53, so that (1) is exact in floating point
and the same on every machine. There is no state: a step taken again gives the same noise.
Source: (1) the permutation of M. Albrecht et al., MiMC, 2016; (3) G. Box, M. Muller, 1958.
Limits: 67 million values; not for cryptography. Counter, seed and channel are rounded to whole numbers.
"""

from typing import Any

import casadi as ca

MODULUS = 67108859
CONSTANTS = (13466917, 32582657, 57885161)


def uniform(counter: Any, seed: Any, channel: int) -> Any:
    """Return a number in (0, 1)."""
    x = ca.SX(0)
    for k in (counter, seed, channel, *CONSTANTS):
        x = _cube(x + _reduced(ca.floor(ca.SX(k) + 0.5)))
    return (x + 0.5) / MODULUS  # (2)


def normal(counter: Any, seed: Any, channel: int) -> Any:
    """Return a number of the normal distribution with deviation 1."""
    u_1, u_2 = uniform(counter, seed, 2 * channel), uniform(counter, seed, 2 * channel + 1)
    return ca.sqrt(-2 * ca.log(u_1)) * ca.cos(2 * ca.pi * u_2)  # (3)


def draws(t: Any, period: Any, seed: Any, size: int, first: int = 0) -> Any:
    """Return a column of numbers of (3), new ones at every period of the time t, channels from `first` on."""
    counter = ca.floor(t / period + 0.5)
    return ca.vertcat(*(normal(counter, seed, first + i) for i in range(size)))


def white(t: Any, period: Any, seed: Any, density: Any, first: int = 0) -> Any:
    """Return a sample of white noise at t for each element of the column `density`, channels from `first` on."""
    return density * draws(t, period, seed, density.numel(), first) / ca.sqrt(2 * period)  # (4)


def _reduced(k: Any) -> Any:
    """Return k mod m, in 0..m-1: fmod has the sign of k."""
    rest = ca.fmod(k, MODULUS)
    return rest + MODULUS * (rest < 0)


def _cube(x: Any) -> Any:
    x = ca.fmod(x, MODULUS)
    return ca.fmod(ca.fmod(x * x, MODULUS) * x, MODULUS)  # (1)
