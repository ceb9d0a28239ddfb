"""The Earth: gravity, oblateness, size."""

MU = 3.986004418e14  # m3/s2
J2 = 1.08262668e-3
EARTH_RADIUS = 6378136.3  # m
