"""The explicit loop in C, over the functions of the FMUs themselves."""
