"""Time series as an FMU: its outputs follow a table over time."""
