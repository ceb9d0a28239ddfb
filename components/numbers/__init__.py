"""The numbers of the papers and of the Earth, each once: start values of components, and what the studies set.

NumPy only, so that reading a number loads nothing else. Units are those of the comments; SI unless said.
"""
