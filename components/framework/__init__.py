"""Floor 0: what a component is. Declarations, units, CasADi functions, the internal integrator."""

from .component import Component, PythonComponent
from .conditions import flag_conditions, lag_condition, not_negative, positive
from .equations import Condition
from .errors import ComponentError
from .ports import ActuatorCluster, AttitudeController, AttitudePlant, Environment, Guidance
from .variables import CalculatedParameter, Input, Output, Parameter, State, Variable

__all__ = [
    "ActuatorCluster",
    "AttitudeController",
    "AttitudePlant",
    "CalculatedParameter",
    "Component",
    "ComponentError",
    "Condition",
    "Environment",
    "Guidance",
    "Input",
    "Output",
    "Parameter",
    "PythonComponent",
    "State",
    "Variable",
    "flag_conditions",
    "lag_condition",
    "not_negative",
    "positive",
]
