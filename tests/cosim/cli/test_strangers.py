"""Packages and folders of our names that are not ours, in the folder where a user works."""

import subprocess
import sys
from pathlib import Path

import pytest

HOME = Path(__file__).parents[3]


def python(folder: Path, code: str) -> subprocess.CompletedProcess:
    """Python in a folder, which is searched first, before our own."""
    path = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(HOME)!r}]; "
    return subprocess.run([sys.executable, "-c", path + code], cwd=folder, capture_output=True, text=True)


@pytest.mark.parametrize("name", ["components", "fmus"])
@pytest.mark.parametrize("form", ["{}/__init__.py", "{}.py"])
def test_a_package_of_the_user_is_named_in_one_sentence(tmp_path, name, form):
    file = tmp_path / form.format(name)
    file.parent.mkdir(exist_ok=True)
    file.write_text("")
    done = python(tmp_path, "sys.argv = ['adcs', 'list']; from adcs_cosim import main; main()")
    where = file if form == "{}.py" else file.parent
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"StrangerFound: adcs-cosim needs its own package '{name}' ({HOME / name}), but Python finds {where}: "
        "rename that one, or start elsewhere.\n"
    )
    imported = python(tmp_path, "import cosim")
    assert done.stderr.removeprefix("StrangerFound: ").strip() in imported.stderr


def test_a_package_called_cosim_is_named_too(tmp_path):
    (tmp_path / "cosim").mkdir()
    (tmp_path / "cosim" / "__init__.py").write_text("")
    done = python(tmp_path, "from adcs_cosim import main; main()")
    assert f"its own package 'cosim' ({HOME / 'cosim'}), but Python finds {tmp_path / 'cosim'}" in done.stderr


@pytest.mark.parametrize("name", ["components", "fmus", "cosim"])
def test_a_mere_folder_of_such_a_name_is_passed_over(tmp_path, name):
    (tmp_path / name).mkdir()
    ours_is_not_on_the_path = f"import adcs_cosim; sys.path.remove({str(HOME)!r}); adcs_cosim.refuse_strangers(); "
    done = python(tmp_path, ours_is_not_on_the_path + "import fmus.places, cosim.time; print(fmus.__file__)")
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(HOME / "fmus" / "__init__.py")
