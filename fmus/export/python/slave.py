"""The script of every python FMU: a pythonfmu slave around the component whose source lies in resources/source.

The source may be edited. It is imported under a name hashed from what is on disk now; if its variables or
dependencies no longer are those of modelDescription.xml, the FMU refuses and says to rebuild it.

Limits, of pythonfmu's wrapper: every exception becomes fmi2Fatal, where a native FMU returns fmi2Error; the instance
stays sound all the same. Null pointers (an instance, values, a state), and a state that is freed twice, are handled
inside the wrapper before anything here is called, and may end the process.
"""

import ctypes
import hashlib
import importlib.util
import json
import sys
import threading
import warnings
import weakref
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


def _missing(error, resources):
    """Return what to do about a package that is not there."""
    package = (error.name or str(error)).partition(".")[0]
    lines = (resources / "requirements.txt").read_text(encoding="utf-8").split()
    needed = next((line for line in lines if line.startswith(package)), package)
    name = json.loads((resources / "component.json").read_text(encoding="utf-8"))["model_name"]
    return (
        f"{name}: the package {package} is not installed for the Python that runs this FMU, {sys.version.split()[0]} "
        f"in {sys.prefix}. Install it there: python -m pip install '{needed}'."
    )


# pythonfmu runs this file, then makes an instance, when an FMU is instantiated; when it is reset it makes one only.
globals().setdefault("_begun", threading.local()).instantiating = True


def _keep(*instances):
    """Before an exception leaves an instance: add a reference to all that pythonfmu holds of it.

    It drops its references when an exception reaches it, and once more when the instance is freed. Each exception needs
    one more, or the memory of a living object is given away, and the process dies of it later, somewhere else. Where
    nobody knows which instance it reaches, all get one: what is left over is never freed.
    """
    for one in instances:
        for held in (one, type(one), one.log_queue):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))


class ComponentSlave(Fmi2Slave):
    """One instance; all behaviour is in fmus/export/python/runtime.py."""

    _living = weakref.WeakSet()

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        instantiating = vars(_begun).pop("instantiating", False)  # noqa: F821
        self._unusable = ""
        resources = Path(kwargs["resources"])
        try:
            self._make(resources)
        except ModuleNotFoundError as error:
            text = _missing(error, resources)
            if sys.stderr is not None:  # pythonfmu logs nothing where a host has switched logging off
                print(text, file=sys.stderr, flush=True)
            if instantiating:
                raise ImportError(text) from error
            self._unusable = f"fmi2Reset: {text}"
        except Exception as error:
            if instantiating:
                raise
            self._unusable = f"fmi2Reset: {type(error).__name__}: {error}"  # raised from here it would end the process
        ComponentSlave._living.add(self)

    def _make(self, resources):
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
        refusals = load(source, files, "fmus.export.python.failure").RuntimeFailure
        self._told = lambda e: str(e) if isinstance(e, refusals) else told(e, source) or f"{type(e).__name__}: {e}"
        self._refusal, self._modes = refusals, load(source, files, "fmus.export.python.modes")
        self.runtime = runtime.Runtime(component, settings["model_name"])
        self.runtime.warn = lambda text: self.log(text, Fmi2Status.warning)
        self.get_real, self.set_real = self._guarded(self.runtime.get), self._guarded(self.runtime.set)
        self._advance = self._guarded(self.runtime.do_step)

    def _guarded(self, function):
        """Return the function; an exception that leaves it is logged, and more than a refusal ends the instance."""

        def call(*arguments):
            try:
                return function(*arguments)
            except BaseException as error:  # Ctrl-C too
                _keep(self)
                if not isinstance(error, self._refusal):
                    self.runtime.mode = self._modes.FAILED
                self.log(self._told(error), Fmi2Status.error)
                raise

        return call

    def _call(self, name, *arguments):
        """Call a method of the runtime, if there is one."""
        if self._unusable:
            _keep(self)
            self.log(self._unusable, Fmi2Status.error)
            raise RuntimeError(self._unusable)
        return self._guarded(getattr(self.runtime, name))(*arguments)

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        """fmi2SetupExperiment."""
        self._call("setup", start_time, stop_time)

    def enter_initialization_mode(self):
        """fmi2EnterInitializationMode."""
        self._call("enter_initialization")

    def exit_initialization_mode(self):
        """fmi2ExitInitializationMode."""
        self._call("exit_initialization")

    def get_real(self, vrs):
        """fmi2GetReal; an instance that can be used has its own."""
        self._call("get", vrs)

    def set_real(self, vrs, values):
        """fmi2SetReal; an instance that can be used has its own."""
        self._call("set", vrs, values)

    def _advance(self, current_time, step_size):
        self._call("do_step", current_time, step_size)

    def do_step(self, current_time, step_size):
        """fmi2DoStep."""
        self._advance(current_time, step_size)
        return True

    def terminate(self):
        """fmi2Terminate: CasADi objects must not live until the interpreter is torn down.

        In a host that is no Python process, CasADi's own data are gone by then: cycles that hold any are opened here.
        """
        component = self.runtime.component if not self._unusable else None
        self._call("terminate")
        self.runtime.release()
        if component is not None:
            vars(component).clear()

    def get_integer(self, vrs):
        """fmi2GetInteger."""
        self._call("require_real", "fmi2GetInteger", vrs)
        return []

    def set_integer(self, vrs, values):
        """fmi2SetInteger."""
        self._call("require_real", "fmi2SetInteger", vrs)

    def get_boolean(self, vrs):
        """fmi2GetBoolean."""
        self._call("require_real", "fmi2GetBoolean", vrs)
        return []

    def set_boolean(self, vrs, values):
        """fmi2SetBoolean."""
        self._call("require_real", "fmi2SetBoolean", vrs)

    def get_string(self, vrs):
        """fmi2GetString."""
        self._call("require_real", "fmi2GetString", vrs)
        return []

    def set_string(self, vrs, values):
        """fmi2SetString."""
        self._call("require_real", "fmi2SetString", vrs)

    def _get_fmu_state(self):
        return self._call("save")

    def _set_fmu_state(self, state):
        self._call("restore", state)

    # Of the class, for pythonfmu calls them there: what they raise may reach any instance.

    @staticmethod
    def _fmu_state_to_bytes(state):
        data = json.dumps(state).encode()
        return _checksum(data) + data

    @staticmethod
    def _fmu_state_from_bytes(state):
        checksum, data = state[:CHECKSUM], state[CHECKSUM:]
        if checksum != _checksum(data):
            _keep(*ComponentSlave._living)
            raise ValueError("fmi2DeSerializeFMUstate: the bytes are damaged: their checksum is another.")
        return json.loads(data)
