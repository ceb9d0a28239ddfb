"""A loop in libcosim, fixed-step algorithm: libcosim_loop.py LOOP.json record; record 1: its file observer."""

import tempfile

from libcosimpy.CosimEnums import CosimVariableType
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
from loop import Clock, Loop, report

loop, record = Loop.told()
log_output_level(CosimLogLevel.ERROR)
simulation = CosimExecution.from_step_size(step_size=round(loop.step * 1e9))
index, references = {}, {}
for name, path in loop.fmus.items():
    index[name] = simulation.add_local_slave(CosimLocalSlave(path, name))
    variables = simulation.slave_variables(index[name])
    references[name] = {v.name.decode(): v.reference for v in variables if v.type == CosimVariableType.REAL.value}
for (source, output), (target, variable) in loop.wires:
    ends = index[source], references[source][output], index[target], references[target][variable]
    simulation.connect_real_variables(*ends)
last, clock, rows = CosimObserver.create_last_value(), Clock(), []
if loop.samples > 1:  # there is no other way to read a value: it is part of the cost
    simulation.add_observer(last)
with tempfile.TemporaryDirectory() as place:
    if record:
        simulation.add_observer(CosimObserver.create_to_dir(place))
    for _ in range(loop.samples):
        for part in loop.parts:
            with clock.running():
                assert simulation.step(part)
        if loop.samples == 1:
            simulation.add_observer(last)
        rows.append([last.last_real_values(index[i], [references[i][v]])[0] for i, v in loop.shown])
report(loop, clock.seconds, rows)
