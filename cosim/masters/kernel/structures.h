/* The structures of the kernel. kernel_layout tells their sizes and offsets to structures.py, which has them in ctypes and
 * compares. */
#include <stddef.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef long long integer;
typedef int (*SetReal)(void *, const unsigned *, size_t, const double *);
typedef int (*GetReal)(void *, const unsigned *, size_t, double *);
typedef int (*SetInteger)(void *, const unsigned *, size_t, const int *);
typedef int (*GetInteger)(void *, const unsigned *, size_t, int *);
typedef int (*SetString)(void *, const unsigned *, size_t, const char *const *);
typedef int (*GetString)(void *, const unsigned *, size_t, const char **);
typedef int (*SetDerivatives)(void *, const unsigned *, size_t, const int *, const double *);
typedef int (*GetDerivatives)(void *, const unsigned *, size_t, const int *, double *);
typedef int (*DoStep)(void *, double, double, int);
typedef int (*GetStatus)(void *, int, int *);
typedef int (*GetRealStatus)(void *, int, double *);
typedef int (*GetState)(void *, void **);
typedef int (*SetState)(void *, void *);

/* turns.py */
enum { AT_POINT, AFTER_STEP, MIDPOINT, RAMP, STEP_MEAN, SMOOTH, MEAN, EXTRAPOLATED, EXTRAPOLATED_MEAN, SIGNAL, SIGNAL_MEAN };
enum { LINE, CURVE, SLOT, SIGNAL_SLOT };
enum { REAL, INTEGER, BOOLEAN, STRING };                           /* types.Kind */
enum { OK = 0, WARNING = 1 };                                      /* the FMI statuses that are a success */
enum { FATAL = 4 };                                                /* after it an instance cannot be used */
enum { /* structures.CALLS: what failed */
    CALL_NONE,
    CALL_SET,
    CALL_SET_DERIVATIVES,
    CALL_STEP,
    CALL_GET,
    CALL_GET_DERIVATIVES,
    CALL_GET_STATE,
    CALL_SET_STATE,
    CALL_NOT_FINITE,
    CALL_REFUSED,
    CALL_MEMORY
};
enum { KINDS = 4, CALLS = CALL_SET_STATE + 1 };
/* A call as one number: which component, what, of which kind; 0 is none. */
#define CALLING(component, call, kind) ((component) << 8 | (call) << 4 | (kind))
#define CALLING_COMPONENT(calling) ((calling) >> 8)
#define CALLING_CALL(calling) ((calling) >> 4 & 15)
#define CALLING_KIND(calling) ((calling) & 15)

/* Variables of one component and kind that are set or read in one call. */
typedef struct {
    integer kind, count;
    const unsigned *references;
    const integer *slots;
    integer first; /* the first slot where they are consecutive, else -1 */
    integer finite; /* how many must be finite */
    const integer *finite_slot;
    double *value; /* work */
    int *number;   /* work */
    const char **text; /* work */
} Group;

/* How often a call has returned fmi2Warning, and in which communication step first. */
typedef struct {
    integer count, first;
} Warned;

/* The values that an input can take. */
typedef struct {
    integer position, count;
    const integer *values;
} Allowed;

/* An input of what a slot shows: factor * *from + addend. */
typedef struct {
    const double *from;
    double factor, addend;
} Wire;

/* A connection on which faults act: faults.Passage; its slots begin at `first`. */
typedef struct {
    integer first, source, slopes;
    const integer *slope;
    double factor, addend;
    unsigned long long key;
} Passage;

typedef struct {
    const char *name;
    Warned *warned; /* CALLS x KINDS */
    void *instance;
    SetReal set_real;
    GetReal get_real;
    SetInteger set_integer;
    GetInteger get_integer;
    SetInteger set_boolean;
    GetInteger get_boolean;
    SetString set_string;
    GetString get_string;
    SetDerivatives set_derivatives;
    GetDerivatives get_derivatives;
    DoStep do_step;
    GetStatus get_status, get_boolean_status;
    GetRealStatus get_real_status;
    GetState get_state;
    SetState set_state;
    GetState free_state;
    void *state; /* work: its FMU state where the step began */
    integer period, at_end, in_step; /* in_step: it and its sources step in every communication step */
    /* inputs: see layout.Inputs and turns.Turn */
    integer inputs, input_groups, only_real; /* only_real: one group of Reals, of which each takes every value */
    const unsigned *input_references;
    const Wire *wire; /* over a step */
    integer mixed;    /* inputs that are more than what a slot shows over a step, their places */
    const integer *mixed_position;
    const Group *input_group;
    const integer *source, *slope_slot, *timing, *ahead, *source_component;
    double *begun, *begun_slope, *value; /* work: of the sources at the start of the period; what is set */
    integer restricted;
    const Allowed *allowed;
    /* input derivatives, see turns.InputDerivatives */
    integer input_derivatives;
    const unsigned *derivative_references;
    const int *derivative_orders;
    const integer *position, *form, *slot;
    double *slope; /* work */
    /* inputs that have slopes when a step ends */
    integer halfway; /* whether any input is held between both ends */
    integer moving;
    const unsigned *moving_references;
    const int *moving_orders;
    const integer *moving_position;
    double *moving_slope; /* work */
    /* outputs: `owned` slots from `offset` on: `outputs`, `output_derivatives`, those of slopes by differences */
    integer outputs, offset, owned, output_groups, output_derivatives;
    const Group *output_group;
    const unsigned *output_derivative_references;
    const int *output_derivative_orders;
    integer differences, step_slot;
    const integer *difference_value, *difference_slope, *difference_before;
    /* faults.h: where they make what passes move in steps, a slot that is not 0 (-1: never; NULL: there are none) */
    const integer *held;
    integer passages, freeze; /* freeze: -1 of one that never is frozen */
    const Passage *passage;
} Component;

typedef struct {
    integer component, groups, slopes;
    const Group *group;
    const Wire *wire; /* of the component's inputs at the communication point */
} Reading;

/* A straight turn or reading, see pass.h. */
typedef struct {
    integer straight, component;
    void *instance;
    SetReal set;
    DoStep step; /* NULL in a reading */
    GetReal get;
    integer inputs, outputs, finite;
    const unsigned *input_references, *output_references;
    const Wire *wire;
    double *input, *output;
    const double *const *finite_value; /* what must be finite */
    integer slopes; /* whether derivatives are set or read, or taken by differences */
    integer kept;   /* whether the inputs of a turn are what the reading at the end of the step before has set */
} Pass;

/* A call of a wave, see waves.h. */
typedef struct {
    integer place, calling; /* the place of its pass; its number */
    void *instance;
    union {
        SetReal set;
        DoStep step;
        GetReal get;
    } function;
    const unsigned *references;
    double *value;
    integer count;
} Call;

enum { SETTING, STEPPING, GETTING, PHASES };         /* of a wave */
enum { FINE = 0, LOOK = 1, FAILED = 2 };             /* how it went; LOOK: something is to be looked at after the step */

/* Passes that take nothing from one another. */
typedef struct {
    integer first, wires, sets, steps, gets, slots; /* first: pass; slots: among which are all that they read */
    const Wire *wire;
    const double *const *bare; /* what the inputs are, where no wire has factor or addend; else NULL */
    double *input;
    const Call *set, *step, *get;
    const double *value;   /* the slots */
    const integer *finite; /* for each slot EXPONENT where it must be finite, else 0 */
} Wave;

/* Components that are repeated until their unknowns agree, see implicit/plan.py. */
typedef struct {
    integer first, members, unknowns, values, memory;
    const integer *slots, *value, *slope, *partner;
    const double *nominal;
    double *x, *residual, *change, *matrix; /* work */
} Loop;

/* The distinct texts of a run; a slot of a String holds the number of its text. */
typedef struct {
    char **text;
    integer count, capacity;
    integer *place, places; /* hash table of numbers, -1: free; `places` is a power of two */
} Texts;

typedef struct Run {
    integer start, stop, step, denominator, every, steps; /* times in units of 1/denominator s */
    integer divisions, events; /* events within steps: their points and counts; the points of all events */
    const integer *divided_at, *dividing, *event_point;
    integer components;
    Component *component;
    integer refreshes;
    const Reading *refresh;
    integer size, owned;           /* slots: all; those of what components return, which come first */
    double *point, *newest, *next; /* slots: as seen at the communication point; as read last; work */
    integer passes;
    const Pass *first_pass; /* the components' turns, then the readings */
    integer all_step;              /* whether every component steps in every communication step */
    integer waves;                 /* 0: there is a pass that is not straight or has slopes, or a step that is divided */
    const Wave *wave;
    int (*unrolled)(struct Run *, integer, double *); /* steps_in_waves of this run, NULL: no such is made */
    int (*careful)(struct Run *, const Wave *, double, double, int, integer, int); /* what that calls */
    /* the own slots of all connected inputs, see layout.Inputs */
    integer inputs;
    const integer *input_slot, *input_source;
    const double *input_factor, *input_addend;
    integer columns;
    const integer *column_slot;
    integer stop_slot; /* the flag that ends the run where it is above FLAG, -1: none */
    const volatile int *stop_asked; /* not 0: return after the step that is running */
    Texts *texts;
    double pending_timeout; /* s */
    /* of the iterated master: its stages, a turn or -1 - loop */
    integer stages;
    const integer *stage;
    Loop *loop;
    double tolerance;
    integer memory_size;
    double *memory, *memory_next; /* what the loops have learned; work */
    integer evaluations, stuck; /* how often loops have stepped; whether the step is left to Python */
    /* where the run stands */
    integer done, last_row, calling; /* calling: which function of an FMU it is in */
    integer ended;    /* 1 + the component that asked for the end with the step that is done, 0: none */
    integer underway; /* whether the step before was the kernel's too, with nothing between */
    /* what ended it, if anything did */
    integer failed_call, failed_component, failed_status, failed_slot, failed_kind; /* of a refused input: is it the end? */
} Run;

/* A signal, and the signals of one component: slaves/tabulated.py. */
typedef struct {
    integer pieces, degree, piece;             /* piece: in which the last time lay */
    const double *knots, *coefficients;        /* pieces + 1; 4 for each piece */
    double value, v0, v1, v2, v3, slope;       /* what the last step has told */
} Channel;
typedef struct {
    integer channels;
    Channel *channel;
} Feed;

/* A scalar of an FMI 3.0 instance, and the instance: slaves/fmi3_kernel.py. */
typedef struct {
    integer type, index, size; /* of its array: size, and where in it the scalar is */
    void *known;               /* what the array was set to */
    unsigned array;            /* value reference */
} Scalar3;
typedef int (*Get3)(void *, const unsigned *, size_t, void *, size_t);
typedef struct {
    void *instance;
    const Scalar3 *scalar;
    void *work; /* as large as the largest array */
    Get3 get[10], set[10];
    int (*get_derivatives)(void *, const unsigned *, size_t, const int *, double *, size_t);
    int (*do_step)(void *, double, double, unsigned char, unsigned char *, unsigned char *, unsigned char *, double *);
    GetState get_state;
    SetState set_state;
    GetState free_state;
    const char *function;                     /* that is called, or was */
    double last;                              /* s, to where the last step came */
    integer terminated, early;                /* what it said of itself */
    integer refused, refused_value;           /* a scalar whose type cannot hold a value, -1: none */
} Fmi3;

/* Where a thread is inside an FMU: in the call of the Python loop, or in the kernel; see slaves/breadcrumb.py. */
typedef struct {
    integer thread, process;
    const char *instance, *function; /* function is NULL outside */
    const Run *run;                  /* NULL outside */
    double time;                     /* s, of the communication point; not a number where there is none */
    integer file, at;                /* run.json, -1: none, and where its status stands in it */
    const char *rows;                /* the file that keeps the rows */
} Breadcrumb;

/* ---- what the caller compares with its own structures ------------------------------------------------------------ */

#define F(structure, field) (integer) offsetof(structure, field)
static const integer layout[] = {
    (integer)sizeof(Group), F(Group, kind), F(Group, count), F(Group, references), F(Group, slots),
    F(Group, first), F(Group, finite), F(Group, finite_slot), F(Group, value), F(Group, number), F(Group, text),
    (integer)sizeof(Allowed), F(Allowed, position), F(Allowed, count), F(Allowed, values),
    (integer)sizeof(Warned), F(Warned, count), F(Warned, first),
    (integer)sizeof(Wire), F(Wire, from), F(Wire, factor), F(Wire, addend),
    (integer)sizeof(Component), F(Component, name), F(Component, warned), F(Component, instance), F(Component, set_real), F(Component, get_real),
    F(Component, set_integer), F(Component, get_integer), F(Component, set_boolean), F(Component, get_boolean),
    F(Component, set_string), F(Component, get_string), F(Component, set_derivatives),
    F(Component, get_derivatives), F(Component, do_step), F(Component, get_status), F(Component, get_boolean_status),
    F(Component, get_real_status), F(Component, get_state), F(Component, set_state),
    F(Component, free_state), F(Component, state), F(Component, period), F(Component, at_end), F(Component, in_step),
    F(Component, inputs), F(Component, input_groups), F(Component, only_real), F(Component, input_references),
    F(Component, wire), F(Component, mixed), F(Component, mixed_position), F(Component, input_group), F(Component, source),
    F(Component, slope_slot), F(Component, timing), F(Component, ahead), F(Component, source_component),
    F(Component, begun), F(Component, begun_slope), F(Component, value), F(Component, restricted),
    F(Component, allowed), F(Component, input_derivatives), F(Component, derivative_references),
    F(Component, derivative_orders), F(Component, position), F(Component, form), F(Component, slot), F(Component, slope),
    F(Component, halfway), F(Component, moving), F(Component, moving_references), F(Component, moving_orders), F(Component, moving_position),
    F(Component, moving_slope), F(Component, outputs), F(Component, offset), F(Component, owned),
    F(Component, output_groups), F(Component, output_derivatives), F(Component, output_group),
    F(Component, output_derivative_references), F(Component, output_derivative_orders), F(Component, differences),
    F(Component, step_slot), F(Component, difference_value), F(Component, difference_slope),
    F(Component, difference_before), F(Component, held), F(Component, passages), F(Component, freeze),
    F(Component, passage),
    (integer)sizeof(Passage), F(Passage, first), F(Passage, source), F(Passage, slopes), F(Passage, slope),
    F(Passage, factor), F(Passage, addend), F(Passage, key),
    (integer)sizeof(Reading), F(Reading, component), F(Reading, groups), F(Reading, slopes), F(Reading, group),
    F(Reading, wire),
    (integer)sizeof(Pass), F(Pass, straight), F(Pass, component), F(Pass, instance), F(Pass, set), F(Pass, step), F(Pass, get), F(Pass, inputs), F(Pass, outputs), F(Pass, finite), F(Pass, input_references), F(Pass, output_references), F(Pass, wire), F(Pass, input), F(Pass, output), F(Pass, finite_value), F(Pass, slopes), F(Pass, kept),
    (integer)sizeof(Call), F(Call, place), F(Call, calling), F(Call, instance), F(Call, function), F(Call, references),
    F(Call, value), F(Call, count),
    (integer)sizeof(Wave), F(Wave, first), F(Wave, wires), F(Wave, sets), F(Wave, steps), F(Wave, gets),
    F(Wave, slots), F(Wave, wire), F(Wave, bare), F(Wave, input), F(Wave, set), F(Wave, step), F(Wave, get), F(Wave, value),
    F(Wave, finite),
    (integer)sizeof(Loop), F(Loop, first), F(Loop, members), F(Loop, unknowns), F(Loop, values), F(Loop, memory),
    F(Loop, slots), F(Loop, value), F(Loop, slope), F(Loop, partner), F(Loop, nominal), F(Loop, x), F(Loop, residual),
    F(Loop, change), F(Loop, matrix),
    (integer)sizeof(Run), F(Run, start), F(Run, stop), F(Run, step), F(Run, denominator), F(Run, every),
    F(Run, steps), F(Run, divisions), F(Run, events), F(Run, divided_at), F(Run, dividing), F(Run, event_point),
    F(Run, components), F(Run, component), F(Run, refreshes), F(Run, refresh), F(Run, size), F(Run, owned),
    F(Run, point), F(Run, newest), F(Run, next), F(Run, passes), F(Run, first_pass), F(Run, all_step), F(Run, waves), F(Run, wave), F(Run, unrolled), F(Run, careful), F(Run, inputs), F(Run, input_slot),
    F(Run, input_source), F(Run, input_factor), F(Run, input_addend), F(Run, columns), F(Run, column_slot),
    F(Run, stop_slot), F(Run, stop_asked), F(Run, texts), F(Run, pending_timeout), F(Run, stages), F(Run, stage), F(Run, loop), F(Run, tolerance),
    F(Run, memory_size), F(Run, memory), F(Run, memory_next), F(Run, evaluations), F(Run, stuck), F(Run, done),
    F(Run, last_row), F(Run, calling), F(Run, ended), F(Run, underway), F(Run, failed_call),
    F(Run, failed_component), F(Run, failed_status), F(Run, failed_slot), F(Run, failed_kind),
    (integer)sizeof(Breadcrumb), F(Breadcrumb, thread), F(Breadcrumb, process), F(Breadcrumb, instance),
    F(Breadcrumb, function), F(Breadcrumb, run), F(Breadcrumb, time), F(Breadcrumb, file), F(Breadcrumb, at),
    F(Breadcrumb, rows),
    (integer)sizeof(Channel), F(Channel, pieces), F(Channel, degree), F(Channel, piece), F(Channel, knots),
    F(Channel, coefficients), F(Channel, value), F(Channel, v0), F(Channel, v1), F(Channel, v2), F(Channel, v3),
    F(Channel, slope),
    (integer)sizeof(Feed), F(Feed, channels), F(Feed, channel),
    (integer)sizeof(Scalar3), F(Scalar3, type), F(Scalar3, index), F(Scalar3, size), F(Scalar3, known), F(Scalar3, array),
    (integer)sizeof(Fmi3), F(Fmi3, instance), F(Fmi3, scalar), F(Fmi3, work), F(Fmi3, get), F(Fmi3, set),
    F(Fmi3, get_derivatives), F(Fmi3, do_step), F(Fmi3, get_state), F(Fmi3, set_state), F(Fmi3, free_state),
    F(Fmi3, function), F(Fmi3, last), F(Fmi3, terminated), F(Fmi3, early), F(Fmi3, refused), F(Fmi3, refused_value),
};

EXPORT const integer *kernel_layout(integer *count)
{
    *count = (integer)(sizeof layout / sizeof layout[0]);
    return layout;
}
