"""What can go wrong when an FMU is built."""

from pathlib import Path


class BuildError(Exception):
    """An FMU cannot be built; the text says what, where and what to do."""


class NoCompiler(BuildError):
    """There is no C compiler that works; fields: tried (commands and modules), platform ("" is this machine's)."""

    def __init__(self, tried: list[str], platform: str = ""):
        self.tried, self.platform = tried, platform
        if platform:
            text = (
                f"no C compiler for {platform} found (tried {', '.join(tried)}). "
                "`pip install 'adcs-cosim[cross]'` brings one for every platform."
            )
        else:
            text = (
                f"no C compiler found (tried {', '.join(tried)}). Install gcc or clang, or "
                "`pip install 'adcs-cosim[cross]'` for one that comes with pip; or build with "
                "--backend python, which needs none."
            )
        super().__init__(text)


class CompileFailed(BuildError):
    """The compiler refused; fields: command, output."""

    def __init__(self, command: list[str], output: str):
        self.command, self.output = command, output
        super().__init__(f"the compiler failed: {' '.join(command)}\n{output.strip()}")


class PlaceUnusable(BuildError):
    """The folder for what is built cannot be used; fields: folder, reason, way_out."""

    def __init__(self, folder: Path, reason: str, way_out: str):
        self.folder, self.reason, self.way_out = folder, reason, way_out
        super().__init__(f"{folder} cannot hold what is built: {reason}. {way_out}")


class ComponentFailed(BuildError):
    """A component's own text contradicts itself or raises; the text has file and line where a file is to blame."""


class UnknownComponent(BuildError):
    """A name is neither in the catalog nor a class in a file; fields: name."""

    def __init__(self, name: str, text: str):
        self.name = name
        super().__init__(text)
