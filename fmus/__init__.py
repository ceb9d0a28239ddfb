"""A component becomes an FMI 2.0 co-simulation FMU: interpreted (pythonfmu) or native (C)."""
