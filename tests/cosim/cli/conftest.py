"""Commands that many tests give: a flight of a paper's system, and one that is refused."""

import pytest

from cosim.results.result import Result


@pytest.fixture
def run(adcs, folder):
    """Fly zhang2018-ppatc for 50 ms, return what was printed and the result."""

    def call(*arguments, system="zhang2018-ppatc", stop="50ms", out="out"):
        done = adcs("run", system, "--stop", stop, "--out", out, *arguments)
        assert done.status == 0, done.err
        return done, Result.read(folder / out)

    return call


@pytest.fixture
def refused(adcs, folder):
    """What a refused command says; that it ran nothing and wrote nothing is checked."""

    def call(*arguments):
        done = adcs(*arguments)
        assert (done.status, list(folder.rglob("result.*"))) == (2, [])
        return " ".join(done.err.replace("│", " ").split())

    return call
