"""The way to the first communication point: exact, the same for every master."""
