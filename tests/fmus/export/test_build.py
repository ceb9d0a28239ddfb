"""Keys of built FMUs: what a process built from its modules must not pass for a build of what was edited meanwhile."""

import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import components
import fmus

EDIT_WHILE_RUNNING = """
    from pathlib import Path
    import components
    from fmus.export.build import build_reference
    file = Path(components.__file__).parent / "environment" / "harmonic_torque.py"
    file.write_text(file.read_text().replace("start=0.0011", "start=0.0022"))
    print(build_reference("HarmonicTorque"))
"""
FREQUENCY_OF_THE_NEXT_PROCESS = """
    from fmpy import read_model_description
    from fmus.export.build import build_reference
    description = read_model_description(str(build_reference("HarmonicTorque")))
    print(next(v.start for v in description.modelVariables if v.name == "frequency"))
"""


def run(code: str, root: Path, monkeypatch) -> str:
    monkeypatch.setenv("ADCS_BUILD", str(root / "build"))
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(root)!r})\n{textwrap.dedent(code)}"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_a_source_edited_while_a_process_runs_is_built_by_the_next_one(tmp_path, monkeypatch):
    for package in (components, fmus):
        source = Path(package.__file__).parent
        shutil.copytree(source, tmp_path / source.name, ignore=shutil.ignore_patterns("build", "__pycache__"))
    run(EDIT_WHILE_RUNNING, tmp_path, monkeypatch)
    assert run(FREQUENCY_OF_THE_NEXT_PROCESS, tmp_path, monkeypatch) == "0.0022"
