"""A flight in libcosim: in_libcosimpy.py FLIGHT.json; prints its end, of the package and of its FMUs alone."""

import json
import os
import sys
from pathlib import Path

from libcosimpy.CosimEnums import CosimVariableType
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

flight = json.loads(Path(sys.argv[1]).read_text())
step = round(flight["step"] * 1e9)
log_output_level(CosimLogLevel.ERROR)


def flown(execution, index, references):
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    assert execution.step(flight["steps"])
    found = [observer.last_real_values(index[i], [references[i][v]])[0] for i, v in flight["names"]]
    print(json.dumps(found), flush=True)


def references_of(execution, slave):
    variables = execution.slave_variables(slave_index=slave)
    return {v.name.decode(): v.reference for v in variables if v.type == CosimVariableType.REAL.value}


execution = CosimExecution.from_ssp_file(ssp_path=flight["ssp"], step_size=step)
index = {name: execution.slave_index_from_instance_name(name) for name in flight["fmus"]}
flown(execution, index, {name: references_of(execution, slave) for name, slave in index.items()})
execution = CosimExecution.from_step_size(step_size=step)
index = {name: execution.add_local_slave(CosimLocalSlave(path, name)) for name, path in flight["fmus"].items()}
references = {name: references_of(execution, slave) for name, slave in index.items()}
for a, y, b, u in flight["links"]:
    execution.connect_real_variables(index[a], references[a][y], index[b], references[b][u])
flown(execution, index, references)
os._exit(0)  # libcosim may end the process of an interpreter that is torn down
