"""A run of the tests fails where a worker ends badly, whatever its tests said: a damaged heap shows at the end."""

import subprocess

import pytest

WORKERS = pytest.StashKey[dict[str, subprocess.Popen]]()
ENDED_BADLY = pytest.StashKey[dict[str, int]]()


def pytest_configure(config: pytest.Config) -> None:
    config.stash[WORKERS], config.stash[ENDED_BADLY] = {}, {}


@pytest.hookimpl(optionalhook=True)
def pytest_testnodeready(node) -> None:
    """Note the process of a worker of pytest-xdist."""
    node.config.stash[WORKERS][node.gateway.id] = node.gateway._io.popen


@pytest.hookimpl(trylast=True)  # pytest-xdist has told them to end by now
def pytest_sessionfinish(session: pytest.Session) -> None:
    for name, process in session.config.stash[WORKERS].items():
        if process.wait(60) != 0:
            session.config.stash[ENDED_BADLY][name] = process.returncode
    if session.config.stash[ENDED_BADLY] and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter, config: pytest.Config) -> None:
    for name, status in config.stash[ENDED_BADLY].items():
        terminalreporter.write_line(f"worker {name} ended with status {status}, after its tests", red=True)
