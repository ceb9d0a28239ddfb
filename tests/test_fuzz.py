"""Whatever is typed or handed over, the outcome is a result or an error of ours: a few of the fuzzers' seeds."""

import pytest
from benchmarks import fuzz_arrays, fuzz_descriptions, fuzz_packages, fuzz_values

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
