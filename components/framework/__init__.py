"""Floor 0: what a component is. Declarations, units, CasADi functions, the internal integrator."""

from .component import Component, Condition, PythonComponent
from .errors import ComponentError
from .variables import CalculatedParameter, Input, Output, Parameter, State, Variable

__all__ = [
    "CalculatedParameter",
    "Component",
    "ComponentError",
    "Condition",
    "Input",
    "Output",
    "Parameter",
    "PythonComponent",
    "State",
    "Variable",
]
