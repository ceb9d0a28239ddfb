"""FMUs in processes of their own: one that crashes, hangs or calls exit() ends the run by name; the master lives."""
