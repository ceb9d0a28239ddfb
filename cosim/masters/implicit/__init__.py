"""Steps that are repeated until what the components exchange agrees at their end."""
