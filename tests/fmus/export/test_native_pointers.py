"""Native FMUs: null pointers and pointers to something else are refused, as far as they can be told."""

import ctypes

import pytest

from .slaves import refused

POINTERS = [  # function, its arguments, the one that is null
    ("GetReal", ("VR", 1, "REALS"), {0: "vr", 2: "value"}),
    ("SetReal", ("VR", 1, "REALS"), {0: "vr", 2: "value"}),
    ("SetRealInputDerivatives", ("VR", 1, "ORDERS", "REALS"), {0: "vr", 2: "order", 3: "value"}),
    ("GetRealOutputDerivatives", ("VR", 1, "ORDERS", "REALS"), {0: "vr", 2: "order", 3: "value"}),
    (
        "GetDirectionalDerivative",
        ("VR", 1, "VR", 1, "REALS", "REALS"),
        {0: "unknown", 2: "known", 4: "dknown", 5: "dunknown"},
    ),
    ("SetDebugLogging", (0, 1, "STRINGS"), {2: "categories"}),
    ("GetStatus", (0, "BUFFER"), {1: "value"}),
    ("GetRealStatus", (2, "BUFFER"), {1: "value"}),
    ("GetIntegerStatus", (0, "BUFFER"), {1: "value"}),
    ("GetBooleanStatus", (3, "BUFFER"), {1: "value"}),
    ("GetStringStatus", (0, "BUFFER"), {1: "value"}),
    ("GetFMUstate", ("STATE",), {0: "state"}),
    ("SerializedFMUstateSize", ("OURS", "BUFFER"), {1: "size"}),
    ("SerializeFMUstate", ("OURS", "BUFFER", 100_000), {1: "bytes"}),
    ("DeSerializeFMUstate", ("BUFFER", 8, "STATE"), {0: "bytes"}),
]


@pytest.mark.parametrize(
    ("function", "arguments", "null", "name"),
    [(f"fmi2{f}", arguments, i, name) for f, arguments, nulls in POINTERS for i, name in nulls.items()],
)
def test_null_pointers_are_refused(open_slave, function, arguments, null, name):
    slave = open_slave("Swing").start()
    ours = slave.getFMUstate()
    stand_ins = {
        "VR": (ctypes.c_uint * 1)(*slave.vr("torque[1]")),
        "REALS": (ctypes.c_double * 1)(),
        "ORDERS": (ctypes.c_int * 1)(1),
        "STRINGS": (ctypes.c_char_p * 1)(b"logAll"),
        "STATE": ctypes.byref(ctypes.c_void_p()),
        "OURS": ours,
        "BUFFER": ctypes.create_string_buffer(100_000),
    }
    given = [stand_ins.get(a, a) if isinstance(a, str) else a for a in arguments]
    given[null] = None
    call = getattr(slave.dll, function)
    call.argtypes, call.restype = None, ctypes.c_int
    pointer = ctypes.c_void_p
    sized = [pointer(None) if a is None else ctypes.c_size_t(a) if isinstance(a, int) else a for a in given]
    assert call(pointer(slave.component), *sized) == 3
    assert slave.messages == [f"{function}: the pointer {name} is null."]
    assert call(pointer(None), *sized) == 3


def test_null_pointers_to_nothing_are_allowed(open_slave):
    slave = open_slave("Swing").start()
    for function in (slave.fmi2GetReal, slave.fmi2SetReal):
        function(slave.component, None, 0, None)
    slave.fmi2SetRealInputDerivatives(slave.component, None, 0, None, None)
    slave.fmi2GetDirectionalDerivative(slave.component, None, 0, None, 0, None, None)
    slave.fmi2FreeFMUstate(slave.component, None)
    slave.fmi2FreeFMUstate(slave.component, ctypes.byref(ctypes.c_void_p(None)))


def test_pointers_that_are_no_states_of_this_fmu_are_refused(open_slave):
    swing, wheel = open_slave("Swing").start(), open_slave("Wheel").start()
    before = swing.everything()
    buffer = ctypes.create_string_buffer(64)
    for foreign, words in (
        (wheel.getFMUstate(), "the state was saved by another FMU than Swing, GUID {"),
        (ctypes.c_void_p(ctypes.addressof(buffer)), "this is no state of an FMU of this kind."),
    ):
        for function, arguments in (
            (swing.fmi2SetFMUstate, (foreign,)),
            (swing.fmi2GetFMUstate, (ctypes.byref(foreign),)),
            (swing.fmi2FreeFMUstate, (ctypes.byref(foreign),)),
            (swing.fmi2SerializedFMUstateSize, (foreign, ctypes.byref(ctypes.c_size_t()))),
            (swing.fmi2SerializeFMUstate, (foreign, ctypes.create_string_buffer(9), 9)),
        ):
            refused(function, swing.component, *arguments)
            assert words in swing.messages.pop()
        assert foreign.value
    assert swing.everything() == before
