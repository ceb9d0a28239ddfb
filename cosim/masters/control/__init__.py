"""How far the next step goes, and whether the last one counts."""
