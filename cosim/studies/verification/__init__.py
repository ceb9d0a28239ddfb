"""How exact a flight is, and up to which step its exchange flies it: the same flight at other steps."""

from cosim.studies.verification.convergence import Convergence
from cosim.studies.verification.limit import Limit
from cosim.studies.verification.study import FILE, Verification, verify
from cosim.studies.verification.trial import Trial

__all__ = ["FILE", "Convergence", "Limit", "Trial", "Verification", "verify"]
