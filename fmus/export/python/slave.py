"""The script of every python FMU: a pythonfmu slave around the component whose source lies in resources/source.

The source may be edited. It is imported under a name hashed from what is on disk now; if its variables or
dependencies no longer are those of modelDescription.xml, the FMU refuses and says to rebuild it.
"""

import hashlib
import importlib.util
import json
import sys
import warnings
from pathlib import Path

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

# What is not finite is told as an error, with its name and time.
warnings.filterwarnings("ignore", category=RuntimeWarning, module=r"adcs_\w+\.fmus\.export\.python\.\w+")


def _loader(source):
    """Import fmus/export/source_loader.py of this FMU under a name of its own content."""
    path = source / "fmus" / "export" / "source_loader.py"
    name = f"adcs_loader_{abs(hash(path.read_bytes())):x}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules.setdefault(name, module)  # another thread may have been first
    return sys.modules[name]


CHECKSUM = 64  # bytes


def _checksum(data):
    return hashlib.sha256(data).hexdigest().encode()


class ComponentSlave(Fmi2Slave):
    """One instance; all behaviour is in fmus/export/python/runtime.py."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        resources = Path(kwargs["resources"])
        source = resources / "source"
        settings = json.loads((resources / "component.json").read_text(encoding="utf-8"))
        found = (p for p in source.rglob("*") if p.is_file() and p.parent.name != "__pycache__")
        files = [p.relative_to(source).as_posix() for p in found]
        load = _loader(source).import_from
        cls = getattr(load(source, files, settings["module"]), settings["class"])
        component = cls(**settings["values"])
        describe = load(source, files, "fmus.export.describe")
        said = describe.summary(describe.describe(component, settings["model_name"], derivatives=False))
        built = json.loads((resources / "interface.json").read_text(encoding="utf-8"))
        for what, now in said.items():
            if now != built[what]:
                pairs = zip(built[what], now, strict=False)
                changed = next((f"{a} is now {b}" for a, b in pairs if a != b), "their number has changed")
                raise RuntimeError(
                    f"{settings['model_name']}: the {what} of the edited source differ from modelDescription.xml "
                    f"({changed}). Rebuild the FMU with `adcs build`."
                )
        runtime = load(source, files, "fmus.export.python.runtime")
        told = load(source, files, "fmus.export.source_loader").told
        # tell all by themselves, as native FMUs do
        refusals = load(source, files, "fmus.export.python.vector").RuntimeFailure
        self._told = lambda e: str(e) if isinstance(e, refusals) else told(e, source) or f"{type(e).__name__}: {e}"
        self.runtime = runtime.Runtime(component, settings["model_name"])
        self.runtime.warn = lambda text: self.log(text, Fmi2Status.warning)
        self.get_real, self.set_real = self._guarded(self.runtime.get), self._guarded(self.runtime.set)
        self._advance = self._guarded(self.runtime.do_step)

    def _guarded(self, function):
        """Return the function; before an exception leaves it, log its text and drop the CasADi objects."""

        def call(*arguments):
            try:
                return function(*arguments)
            except Exception as error:
                self.log(self._told(error), Fmi2Status.error)
                self.runtime.release()
                raise

        return call

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        """fmi2SetupExperiment."""
        self._guarded(self.runtime.setup)(start_time, stop_time)

    def exit_initialization_mode(self):
        """fmi2ExitInitializationMode."""
        self._guarded(self.runtime.exit_initialization)()

    def do_step(self, current_time, step_size):
        """fmi2DoStep."""
        self._advance(current_time, step_size)
        return True

    def terminate(self):
        """fmi2Terminate: CasADi objects must not live until the interpreter is torn down."""
        self.runtime.release()

    def _get_fmu_state(self):
        return self.runtime.save()

    def _set_fmu_state(self, state):
        self.runtime.restore(state)

    # Of the class, for pythonfmu calls them there: it puts what they raise into its message.

    @staticmethod
    def _fmu_state_to_bytes(state):
        data = json.dumps(state).encode()
        return _checksum(data) + data

    @staticmethod
    def _fmu_state_from_bytes(state):
        checksum, data = state[:CHECKSUM], state[CHECKSUM:]
        if checksum != _checksum(data):
            raise ValueError("fmi2DeSerializeFMUstate: the bytes are damaged: their checksum is another.")
        return json.loads(data)
