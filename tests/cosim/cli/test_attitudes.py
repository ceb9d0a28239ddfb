"""--set plant.q_BN='euler321(10,20,30) deg', in a parameter file too."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from cosim.cli.attitudes import value_of
from cosim.cli.overrides import assignments, parameter_file
from cosim.errors import ParameterError
from cosim.system import Value

EXPECTED = Rotation.from_euler("ZYX", [10, 20, 30], degrees=True).as_quat(scalar_first=True)


def test_on_the_command_line_and_in_a_file(folder):
    text = "euler321(10, 20, 30) deg"
    (folder / "p.toml").write_text(f'[plant]\nq_BN = "{text}"\nname = "euler"\n')
    for values in (assignments([f"plant.q_BN={text}"]), parameter_file(folder / "p.toml")):
        assert_allclose(values["plant.q_BN"].value, EXPECTED, atol=1e-15)
    assert parameter_file(folder / "p.toml")["plant.name"] == Value("euler")


def test_radians_and_an_axis():
    angles = ",".join(map(str, np.radians([10, 20, 30])))
    assert_allclose(value_of(f"euler321({angles}) rad", "q").value, EXPECTED, atol=1e-15)
    assert_allclose(value_of("axis(0,0,2; 60) deg", "q").value, [np.sqrt(0.75), 0, 0, 0.5], atol=1e-15)


@pytest.mark.parametrize(
    "text, message",
    [
        ("euler311(1,2,3) deg", "euler311 is no sequence of Euler angles. There are 121, 123, 131, 132, 212"),
        ("euler(1,2,3) deg", "euler is no sequence"),
        ("euler321(1,2) deg", "takes three finite angles, there are 2"),
        ("euler321(1,2,x) deg", "could not convert string to float"),
        ("euler321(1,2,3)", "has no unit. Write it as 'euler321(30, 20, 10) deg'"),
        ("euler321(1,2,3) grad", "has the unit grad"),
        ("euler321(1,2,3", "is no attitude. Write it as"),
        ("axis(0,0,1) deg", "an axis and an angle are needed"),
    ],
)
def test_what_is_refused(text, message):
    with pytest.raises(ParameterError) as caught:
        value_of(text, "plant.q_BN")
    assert message in str(caught.value) and "plant.q_BN" in str(caught.value)


def test_it_flies(adcs, folder):
    done = adcs("run", "xiao2011-pid", "--stop", "5ms", "--out", "out", "--set", "plant.q_BN=euler123(0,0.01,0) deg")
    assert done.status == 0, done.err
    from cosim.results.result import Result

    q = Result.read(folder / "out")["plant.q_BN"][0]
    assert_allclose(q, [np.cos(np.radians(0.005)), 0, np.sin(np.radians(0.005)), 0], atol=1e-15)
