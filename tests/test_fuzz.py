"""Whatever is typed or handed over, the outcome is a result or an error of ours: a few of the fuzzers' seeds."""

import pytest
from benchmarks import fuzz_arrays, fuzz_descriptions, fuzz_faults, fuzz_packages, fuzz_values

COUNT = 500


@pytest.mark.slow
@pytest.mark.parametrize(
    "fuzzer",
    [fuzz_values, fuzz_descriptions, fuzz_arrays, fuzz_packages],
    ids=["values", "descriptions", "arrays", "packages"],
)
def test_every_outcome_is_a_result_or_an_error_of_ours(fuzzer, tmp_path):
    outcomes = {fuzzer.attempt(seed, tmp_path) for seed in range(COUNT)}
    assert outcomes & {"taken", "read"} and len(outcomes) >= 3


@pytest.mark.slow
def test_faults_give_one_table_in_both_loops_and_in_runs_that_go_on(tmp_path):
    assert {fuzz_faults.attempt(seed, tmp_path) for seed in range(60)} == {"cut", "extended", "refused"}
