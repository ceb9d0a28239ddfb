"""Equations of spacecraft attitude control: plants, controllers, actuators, guidance, environment.

Knows nothing of FMI, files or time loops; a component is declared variables and CasADi expressions.
"""
