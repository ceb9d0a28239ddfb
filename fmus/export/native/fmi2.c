/* FMI 2.0 co-simulation slave around the C code that CasADi writes for a component.
 *
 * Written by hand, the same for every component; the twin of fmus/export/python/runtime.py, rule for rule. Generated beside it:
 *   model.h   name and GUID, sizes, variables (name, start value, when they may be set), texts of the conditions,
 *             which parameters mean something to this file, what is said of unit vectors
 *   model.c   the component's functions of flat vectors; which of them exist is seen from CasADi's macros <name>_SZ_ARG
 *
 * One flat vector holds every variable, a value reference is an index into it (sizes NP, NC, ... from model.h):
 *   v = [ p parameters | c calculated parameters | u inputs | x states | y outputs that are no states | s | d rates of x ]
 * The first NE of y have a start that is set, from which `initial` calculates states; it stands while nothing is set or stepped.
 * m, beside it, are the step means: outputs that are the mean of a rate over the last step. k and g are what equations
 * keep that follows from parameters, and from parameters and inputs (native/cut.py): k belongs to p and c, g to their
 * values and to inputs that are kept with it. s is the internal step taken, where there are any.
 *
 * One translation unit: all but the fmi2 functions is static. No mutable static data, no heap in fmi2DoStep.
 * Numbers equal those of the Python twin bit for bit where the compiler contracts no products (-ffp-contract=off).
 */
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(__GNUC__) /* fmi2Functions.h marks what is exported; CasADi's helpers are not */
#pragma GCC visibility push(hidden)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#define CASADI_SYMBOL_EXPORT static
#include "model.c"
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#pragma GCC visibility pop
#endif

#include "fmi2Functions.h"

typedef struct {
    const char *name;
    double start;
    int flags;
} Variable;

enum { SET_BEFORE = 1, SET_BETWEEN = 2, OUTPUT = 4 }; /* settable before the end of initialization, between steps */

enum { FIELD = 1 }; /* in the text of a condition: the place of a number */
enum { OF_PARAMETERS = 1, OF_STATES = 2, OF_INPUTS = 4, OF_ANYTHING = 7 }; /* what a condition depends on at most */

#include "model.h"

#if !SAMPLED && NX
#include "internal_step.c"
#endif

/* ---- data ------------------------------------------------------------------------------------------------------- */

enum { P0 = 0, C0 = P0 + NP, U0 = C0 + NC, X0 = U0 + NU, Y0 = X0 + NX, S0 = Y0 + NY, D0 = S0 + NS, NV = D0 + ND };

#define TICK 1e-9      /* s, how near to a communication point a sample counts as due there */
#define MOST_STEPS 1e9 /* internal steps or samples in a communication step */

typedef enum { INSTANTIATED = 1, INITIALIZATION = 2, STEPPING = 4, TERMINATED = 8, FAILED = 16, ANY = 31 } Mode;

typedef struct { /* g with the inputs that it belongs to */
    double u[NU + 1], g[NG + 1];
    int64_t known; /* what is: NOTHING, g of the rates, all of it */
} Held;

enum { NOTHING = 0, OF_RATES = 1, ALL = 2 };

typedef struct { /* everything that an FMU state holds: plain data, no pointers */
    double t, t0, stop;
    double v[NV + 1], m[NM + 1];
    double u1[NU + 1], u2[NU + 1], u3[NU + 1]; /* input derivatives of order 1, 2, 3 */
    double k[NK + 1];
    double automatic; /* s, longest internal step where none is set; 0: to be found */
    Held held;
    double x_next[NX + 1];         /* sampled: states after the sample that the outputs show */
    int64_t sample;                /* sampled: index of the next sample */
    int32_t mode, stop_defined;
    int32_t inputs_move;                 /* input derivatives were given since the last step */
    int32_t due;                         /* sampled: the next sample is due at t */
    int32_t waiting;                     /* for inputs that are not refused: those that were set are in `given` */
    double given[NU + 1];
    int32_t start_old, y_old, d_old;     /* to be evaluated: c (and, in initialization, x and m); y; d */
    double dy[NY + 1];                   /* rates of y */
    int32_t dy_asked, dy_old;            /* whether somebody asks for them; to be evaluated */
} State;

typedef struct {
    State s;
    fmi2CallbackFunctions callbacks;
    char name[256];
#if !SAMPLED && NX
    InternalStep internal_step; /* what is to be told of it, once */
#endif
} Instance;

typedef struct { /* an FMU state as a host keeps it, in memory or as bytes; its head tells whose it is */
    char magic[8];
    uint32_t version, size;
    char guid[64];
    uint64_t checksum; /* of all the others, where it is bytes */
    State s;
} Saved;

static const char MAGIC[8] = {'a', 'd', 'c', 's', 'f', 'm', 'u', '2'};
enum { SAVED_VERSION = 6 };

/* ---- messages --------------------------------------------------------------------------------------------------- */

/* All that this FMU ever logs are errors and three kinds of warnings, which a host wants to see whatever it has switched on. */
static void tell(const Instance *it, fmi2Status status, const char *category, const char *format, va_list arguments)
{
    char text[1024];
    if (!it->callbacks.logger) return;
    vsnprintf(text, sizeof text, format, arguments);
    it->callbacks.logger(it->callbacks.componentEnvironment, it->name, status, category, "%s", text);
}

static fmi2Status fail(const Instance *it, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    tell(it, fmi2Error, "logStatusError", format, arguments);
    va_end(arguments);
    return fmi2Error;
}

#if (!SAMPLED && NX) || defined normalise_SZ_ARG || CHECKS_INPUTS
static fmi2Status warn(const Instance *it, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    tell(it, fmi2Warning, "logStatusWarning", format, arguments);
    va_end(arguments);
    return fmi2Warning;
}
#endif

static const char *in_words(int mode)
{
    switch (mode) {
    case INSTANTIATED: return "before initialization mode";
    case INITIALIZATION: return "in initialization mode";
    case STEPPING: return "after initialization";
    case TERMINATED: return "after fmi2Terminate";
    default: return "after an error";
    }
}

static fmi2Status admit(const Instance *it, const char *function, int modes)
{
    if (!it) return fmi2Error;
    if (it->s.mode & modes) return fmi2OK;
    return fail(it, "%s: not allowed %s.", function, in_words(it->s.mode));
}

#define ENTER(function, modes)                                                                                         \
    Instance *it = (Instance *)c;                                                                                      \
    State *s = it ? &it->s : NULL;                                                                                     \
    if (admit(it, function, modes) != fmi2OK) return fmi2Error;                                                        \
    (void)s

/* Refuse a null pointer to n values; without values it is allowed. */
#define NEED(function, pointer, n)                                                                                     \
    do {                                                                                                               \
        if ((n) > 0 && !(pointer)) return fail(it, "%s: the pointer " #pointer " is null.", function);                 \
    } while (0)

static int within(fmi2ValueReference r, int first, int size) { return r - (unsigned)first < (unsigned)size; }

static const char *name_of(fmi2ValueReference r) { return within(r, 0, NV) ? variables[r].name : "(none)"; }

static fmi2Status no_such_variable(const Instance *it, const char *function, fmi2ValueReference r)
{
    return fail(it, "%s: there is no Real variable with value reference %u.", function, r);
}

/* ---- equations -------------------------------------------------------------------------------------------------- */

/* Call a CasADi function with lists of pointers, IN its arguments and OUT its results, which may not overlap them. */
#define IN(...) {__VA_ARGS__}
#define OUT(...) {__VA_ARGS__}
#define CALL(f, in, out)                                                                                               \
    do {                                                                                                               \
        const double *arguments_[f##_SZ_ARG] = in;                                                                     \
        double *results_[f##_SZ_RES] = out;                                                                            \
        double work_[f##_SZ_W + 1];                                                                                    \
        int integers_[f##_SZ_IW + 1];                                                                                  \
        f(arguments_, results_, integers_, work_, 0);                                                                  \
    } while (0)

/* Regions of a vector like v. */
#define P(v) ((v) + P0)
#define C(v) ((v) + C0)
#define U(v) ((v) + U0)
#define X(v) ((v) + X0)
#define Y(v) ((v) + Y0)
#define D(v) ((v) + D0)

/* u(since) = u + since (u1 + since (u2 + since u3 / 3) / 2) */
static void inputs_at(const State *s, double since, double *u)
{
    int i;
    for (i = 0; i < NU; i++)
        u[i] = U(s->v)[i] + since * (s->u1[i] + 0.5 * since * (s->u2[i] + since * s->u3[i] / 3));
}

/* Whether n numbers are the same bits: zeros with and without sign may part what is made of them. */
static int same(const double *a, const double *b, size_t n) { return memcmp(a, b, n * sizeof *a) == 0; }

static void forget_input_derivatives(State *s)
{
    memset(s->u1, 0, sizeof s->u1);
    memset(s->u2, 0, sizeof s->u2);
    memset(s->u3, 0, sizeof s->u3);
}

#if !SAMPLED && (defined outputs_SZ_ARG || defined rates_SZ_ARG)
/* Keep inputs u with g of them, OF_RATES or ALL. */
static void hold(const State *s, Held *own, const double *u, int what)
{
    if (own->known >= what && same(own->u, u, NU)) return;
    memcpy(own->u, u, NU * sizeof *u);
    own->known = ALL;
#ifdef held_rates_SZ_ARG
    if (what == OF_RATES) {
        CALL(held_rates, IN(u, P(s->v), C(s->v), s->k), OUT(own->g));
        own->known = OF_RATES;
        return;
    }
#endif
#ifdef held_SZ_ARG
    CALL(held, IN(u, P(s->v), C(s->v), s->k), OUT(own->g));
#endif
    (void)s, (void)what;
}
#endif

/* Whether initial values follow what is set: in initialization mode, and after it while inputs are waited for. */
#define STARTING(s) ((s)->mode == INITIALIZATION || (s)->waiting)

/* Calculate states and step means from the values set. */
static void begin(State *s)
{
#ifdef initial_SZ_ARG
    {
        double x[NX + 1];
        CALL(initial, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v), Y(s->v)), OUT(x));
        memcpy(X(s->v), x, NX * sizeof x[0]);
    }
#endif
#ifdef mean_rates_SZ_ARG
    CALL(mean_rates, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v)), OUT(s->m));
#endif
    (void)s;
}

#ifdef check_SZ_ARG
/* Return of which kinds conditions do not hold. */
static int broken(const State *s)
{
    double margin[N_CONDITIONS], shown[N_SHOWN + 1];
    int i, found = 0;
    CALL(check, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v)), OUT(margin, shown));
    for (i = 0; i < N_CONDITIONS; i++)
        if (!(margin[i] > 0)) found |= condition_of[i]; /* a NaN violates */
    return found;
}
#endif

#if CHECKS_INPUTS
/* Begin with the inputs that were given, where they are refused with their start values. */
static void begin_waiting(State *s)
{
    int i;
    memcpy(U(s->v), s->given, NU * sizeof s->given[0]);
    begin(s);
    if (!(broken(s) & OF_INPUTS)) return;
    for (i = 0; i < NU; i++) U(s->v)[i] = variables[U0 + i].start;
    begin(s);
}
#endif

/* Bring up to date what follows from parameters and, while it starts, from initial values. */
static void settle(State *s)
{
    if (!s->start_old) return;
    s->start_old = 0;
#ifdef calculate_SZ_ARG
    CALL(calculate, IN(P(s->v)), OUT(C(s->v)));
#endif
#ifdef fixed_SZ_ARG
    CALL(fixed, IN(P(s->v), C(s->v)), OUT(s->k));
#endif
    s->held.known = NOTHING;
    s->automatic = 0;
#if CHECKS_INPUTS
    if (s->waiting) {
        begin_waiting(s);
        return;
    }
#endif
    if (s->mode == INITIALIZATION) begin(s);
}

#if SAMPLED
/* Evaluate the sample at t with inputs u: the states after it, and the outputs. */
static void sample_at(State *s, double t, const double *u)
{
#ifdef update_SZ_ARG
    CALL(update, IN(&t, X(s->v), u, P(s->v), C(s->v), s->k, NULL), OUT(s->x_next));
#endif
#ifdef outputs_SZ_ARG
    CALL(outputs, IN(&t, s->x_next, u, P(s->v), C(s->v), s->m, s->k, NULL), OUT(Y(s->v)));
#endif
    (void)t, (void)u;
}
#endif

#if !SAMPLED && defined slopes_SZ_ARG
/* Bring outputs, state derivatives and rates of outputs up to date at once: they have much in common. */
static void observe(State *s)
{
    double set[NE + 1];
    memcpy(set, Y(s->v), NE * sizeof set[0]);
    CALL(slopes, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v), s->m, s->u1, s->k, NULL),
         OUT(Y(s->v), D(s->v), s->dy));
    if (STARTING(s)) memcpy(Y(s->v), set, NE * sizeof set[0]);
    s->y_old = s->d_old = s->dy_old = 0;
}
#endif

/* Bring the outputs up to date. Between samples those of a sampled component are held. */
static void show(State *s)
{
    settle(s);
    if (!s->y_old) return;
#if !SAMPLED && defined slopes_SZ_ARG
    if (s->dy_asked && !STARTING(s)) {
        observe(s);
        return;
    }
#endif
    s->y_old = 0;
#if SAMPLED
    if (s->due) sample_at(s, s->t, U(s->v));
#elif defined outputs_SZ_ARG
    {
        double set[NE + 1];
        memcpy(set, Y(s->v), NE * sizeof set[0]);
        if (OUTPUTS_HELD) hold(s, &s->held, U(s->v), ALL);
        CALL(outputs, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v), s->m, s->k, s->held.g), OUT(Y(s->v)));
        if (STARTING(s)) memcpy(Y(s->v), set, NE * sizeof set[0]);
    }
#endif
}

/* Bring the state derivatives up to date. */
static void rate(State *s)
{
    settle(s);
    if (!s->d_old) return;
    s->d_old = 0;
#ifdef rates_SZ_ARG
    hold(s, &s->held, U(s->v), OF_RATES);
    CALL(rates, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v), s->k, s->held.g), OUT(D(s->v)));
#endif
}

/* Put the rates of states, and where asked for those of outputs, into a vector like v: y' = dy/dt + dy/dx x' + dy/du u',
 * step means held. */
static void slope(State *s, int of_outputs, double *r)
{
    settle(s);
#if !SAMPLED && defined slopes_SZ_ARG
    if (of_outputs) {
        s->dy_asked = 1;
        if (s->dy_old) observe(s);
        memcpy(Y(r), s->dy, NY * sizeof r[0]);
    }
#endif
    rate(s);
    memcpy(X(r), D(s->v), ND * sizeof r[0]);
    (void)of_outputs;
}

/* Directional derivative of c, x, y and d along a seed of time and of p, u and x, in initialization mode of the outputs
 * with a start too; both are laid out like v, the result is zero before. In initialization mode c, the calculated states
 * and the step means follow the seed, later they do not. */
static void tangent(const State *s, double st, const double *seed, double *result)
{
    double *sx = X(result), sm[NM + 1] = {0};
    memcpy(sx, X(seed), NX * sizeof sx[0]);
    if (s->mode == INITIALIZATION) {
#ifdef calculate_forward_SZ_ARG
        CALL(calculate_forward, IN(P(s->v), P(seed)), OUT(C(result)));
#endif
#ifdef initial_forward_SZ_ARG
        CALL(initial_forward, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v), Y(s->v), &st, X(seed), U(seed), P(seed),
             Y(seed)), OUT(sx, sm));
#endif
    }
#ifdef forward_SZ_ARG
    if (!SAMPLED || s->due)
        CALL(forward, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v), &st, sx, U(seed), P(seed), sm),
             OUT(D(result), Y(result)));
    if (s->mode == INITIALIZATION) memcpy(Y(result), Y(seed), NE * sizeof *result); /* these are set */
#endif
    (void)st, (void)sm;
}

/* ---- life cycle ------------------------------------------------------------------------------------------------- */

static void restart(State *s)
{
    int i;
    memset(s, 0, sizeof *s);
    for (i = 0; i < NV; i++) s->v[i] = variables[i].start;
    s->mode = INSTANTIATED;
    s->due = SAMPLED;
    s->start_old = s->y_old = s->d_old = s->dy_old = 1;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    Instance *it = (Instance *)calloc(1, sizeof *it);
    const char *wrong = NULL;
    (void)resources, (void)visible, (void)logging;
    if (!it) return NULL;
    if (callbacks) it->callbacks = *callbacks;
    snprintf(it->name, sizeof it->name, "%s", name ? name : "");
    if (!it->name[0]) wrong = "the instance name is empty";
    else if (type != fmi2CoSimulation) wrong = "this FMU is for co-simulation only";
    else if (!guid || strcmp(guid, MODEL_GUID) != 0) wrong = "the GUID given is that of another FMU";
    if (wrong) {
        fail(it, "fmi2Instantiate: %s (%s, GUID %s).", wrong, MODEL_NAME, MODEL_GUID);
        free(it);
        return NULL;
    }
    restart(&it->s);
    return it;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    ENTER("fmi2SetDebugLogging", ANY);
    NEED("fmi2SetDebugLogging", categories, n);
    (void)on;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop)
{
    ENTER("fmi2SetupExperiment", INSTANTIATED);
    (void)tolerance_defined, (void)tolerance;
    if (!isfinite(start)) return fail(it, "fmi2SetupExperiment: start time = %g is not finite.", start);
    if (stop_defined && !(stop >= start))
        return fail(it, "fmi2SetupExperiment: stop time %g s is not after start time %g s.", stop, start);
    s->t = s->t0 = start;
    s->stop_defined = stop_defined != fmi2False;
    s->stop = stop_defined ? stop : 0;
    return fmi2OK;
}

#ifdef normalise_SZ_ARG
/* Divide unit vectors that were typed by their length, in flight only parameters, and say so. */
static void normalise_typed(Instance *it)
{
    State *s = &it->s;
    double length[N_UNIT_VECTORS], x[NX + 1], p[NP + 1];
    int i = s->mode == STEPPING ? N_UNIT_STATES : 0;
    CALL(normalise, IN(X(s->v), P(s->v)), OUT(length, x, p));
    if (s->mode != STEPPING) memcpy(X(s->v), x, NX * sizeof x[0]);
    memcpy(P(s->v), p, NP * sizeof p[0]);
    for (; i < N_UNIT_VECTORS; i++) {
        const double off = fabs(length[i] - 1);
        if (!(off > UNIT_ROUNDING && off <= UNIT_TYPED)) continue;
        s->start_old = s->y_old = s->d_old = s->dy_old = 1;
        warn(it, "%s: %s %.12g. It was divided by that.", MODEL_NAME, unit_vectors[i], length[i]);
    }
}
#endif

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    ENTER("fmi2EnterInitializationMode", INSTANTIATED);
    s->mode = INITIALIZATION;
#ifdef normalise_SZ_ARG
    normalise_typed(it);
#endif
    return fmi2OK;
}

#ifdef check_SZ_ARG
/* Say of every condition of these kinds that does not hold. */
static void report_conditions(const Instance *it, int kinds, fmi2Status (*say)(const Instance *, const char *, ...))
{
    const State *s = &it->s;
    double margin[N_CONDITIONS], shown[N_SHOWN + 1], *number = shown;
    int i;
    CALL(check, IN(&s->t, X(s->v), U(s->v), P(s->v), C(s->v)), OUT(margin, shown));
    for (i = 0; i < N_CONDITIONS; i++) {
        char text[768], *to = text, *const end = text + sizeof text - 32;
        const char *from = conditions[i];
        for (; *from; from++) {
            if (*from == FIELD) to += to < end ? snprintf(to, 32, "%g", *number) : 0, number++;
            else if (to < end) *to++ = *from;
        }
        *to = 0;
        if (!(margin[i] > 0) && (condition_of[i] & kinds)) say(it, "%s: %s", MODEL_NAME, text); /* a NaN violates */
    }
}

/* Whether a condition of these kinds does not hold; it is said which. */
static int refuses(const Instance *it, int kinds)
{
    if (!(broken(&it->s) & kinds)) return 0;
    report_conditions(it, kinds, fail);
    return 1;
}
#endif

#if !SAMPLED && NX
/* result = df/dx seed, NX values each; v and d are rooms like State.v. */
static void jacobian_times(const State *s, const double *seed, double *result, double *v, double *d)
{
    memset(v, 0, NV * sizeof *v);
    memset(d, 0, NV * sizeof *d);
    memcpy(X(v), seed, NX * sizeof *v);
    tangent(s, 0, v, d);
    memcpy(result, D(d), NX * sizeof *v);
}

#if NX <= LARGEST_MATRIX
/* Put the eigenvalues of df/dx into `lambda`, which has place for NX; return how many, 0 where they cannot be had. */
static int fastest(const State *s, Complex *lambda)
{
    Complex *h = (Complex *)calloc(NX * NX + 2 * NX, sizeof *h);
    double seed[NX] = {0}, column[NX], v[NV + 1], d[NV + 1];
    int i, j, found = h != NULL;
    for (j = 0; j < NX && found; j++) {
        seed[j] = 1;
        jacobian_times(s, seed, column, v, d);
        seed[j] = 0;
        for (i = 0; i < NX; i++) h[i * NX + j].re = column[i], found = found && isfinite(column[i]);
    }
    found = found && eigenvalues(h, NX, lambda, h + NX * NX);
    free(h);
    return found ? NX : 0;
}
#else
/* Put the eigenvalue with the largest modulus, as one that decays, into `lambda`; return 1, 0 where it cannot be had. */
static int fastest(const State *s, Complex *lambda)
{
    double seed[NX], column[NX], v[NV + 1], d[NV + 1], growth = 0;
    int i, k;
    for (i = 0; i < NX; i++) seed[i] = cos(1.0 + i * i);
    for (k = 0; k < GROWTH_STEPS; k++) {
        double size = 0;
        jacobian_times(s, seed, column, v, d);
        for (i = 0; i < NX; i++) size = hypot(size, column[i]);
        if (!(size > 0) || !isfinite(size)) return 0;
        for (i = 0; i < NX; i++) seed[i] = column[i] / size;
        if (k > 0 && k >= GROWTH_STEPS / 2) growth += log(size);
    }
    lambda->re = -exp(growth / (GROWTH_STEPS - GROWTH_STEPS / 2));
    lambda->im = 0;
    return 1;
}
#endif

/* See up to which internal step RK4 follows the dynamics as they are now. */
static void judge_internal_step(Instance *it)
{
    Complex lambda[NX] = {{0, 0}};
    const double largest = P(it->s.v)[SOLVER_STEP];
    const int n = largest > 0 && isfinite(largest) ? fastest(&it->s, lambda) : 0;
    it->internal_step = judged(lambda, n, largest);
}

/* The longest internal step that is allowed now: the one set, or that of the dynamics. */
static double longest_internal_step(State *s)
{
    if (P(s->v)[SOLVER_STEP] != 0) return P(s->v)[SOLVER_STEP];
    if (s->automatic == 0) {
        Complex lambda[NX] = {{0, 0}};
        s->automatic = automatic(lambda, fastest(s, lambda));
    }
    return s->automatic;
}

/* Tell once that internal steps are too long. */
static void warn_of_internal_step(Instance *it, double h)
{
    const InternalStep *told = &it->internal_step;
    if (told->unstable)
        warn(it, "%s: an internal step of %.3g s is too long for its dynamics: at the start a rate of %.3g 1/s decays, "
             "which RK4 lets grow. solver.step = %.3g s would do.", MODEL_NAME, h, told->rate, told->advice);
    else
        warn(it, "%s: an internal step of %.3g s is too long for its dynamics: at the start it turns or swings at a rate of "
             "%.3g 1/s, of which RK4 loses more than %g in %g revolutions. solver.step = %.3g s would do.", MODEL_NAME, h,
             told->rate, LOSS, REVOLUTIONS, told->advice);
    it->internal_step.longest = 0;
}
#endif

#if CHECKS_INPUTS
/* Leave initialization although inputs are refused: a host may know better ones before it steps. The warnings are in the
 * log alone: there are hosts that take the status fmi2Warning for an error, as there are those that set inputs to 0. */
static void wait_for_inputs(Instance *it)
{
    State *s = &it->s;
    report_conditions(it, OF_INPUTS, warn);
    memcpy(s->given, U(s->v), NU * sizeof s->given[0]);
    s->waiting = s->start_old = s->y_old = s->d_old = s->dy_old = 1;
    settle(s);
    warn(it, "%s: %s.", MODEL_NAME, INPUTS_REFUSED);
}

/* Begin with the inputs that were given, or refuse to step. */
static fmi2Status take_inputs(Instance *it)
{
    State *s = &it->s;
    memcpy(U(s->v), s->given, NU * sizeof s->given[0]);
    begin(s);
    s->start_old = s->y_old = s->d_old = s->dy_old = 1;
    if (refuses(it, OF_INPUTS)) return fmi2Error;
    s->waiting = 0;
    s->start_old = 0; /* it has begun */
    s->automatic = 0;
#if !SAMPLED && NX
    judge_internal_step(it);
#endif
    if (SAMPLED) show(s); /* what a sample that is due commits: solver.commit_shown */
    return fmi2OK;
}
#endif

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
#ifdef check_SZ_ARG
    int found;
#endif
    ENTER("fmi2ExitInitializationMode", INITIALIZATION);
#ifdef normalise_SZ_ARG
    normalise_typed(it);
#endif
    show(s);
    s->mode = FAILED;
#if SAMPLED
    if (!(P(s->v)[SAMPLE_TIME] > 0))
        return fail(it, "%s: sample_time = %g s is not positive.", MODEL_NAME, P(s->v)[SAMPLE_TIME]);
#endif
#ifdef check_SZ_ARG
    found = broken(s);
    if (found & ~OF_INPUTS) {
        report_conditions(it, OF_ANYTHING, fail);
        return fmi2Error;
    }
#endif
    s->mode = STEPPING;
#if CHECKS_INPUTS
    if (found) wait_for_inputs(it);
#endif
#if !SAMPLED && NX
    judge_internal_step(it);
    (void)longest_internal_step(s);
#endif
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    ENTER("fmi2Terminate", STEPPING | FAILED);
    s->mode = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    ENTER("fmi2Reset", ANY);
    restart(s);
    return fmi2OK;
}

/* ---- values ----------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    size_t i;
    ENTER("fmi2GetReal", INITIALIZATION | STEPPING | TERMINATED | FAILED);
    NEED("fmi2GetReal", vr, n);
    NEED("fmi2GetReal", value, n);
    for (i = 0; i < n; i++) {
        if (!within(vr[i], 0, NV)) return no_such_variable(it, "fmi2GetReal", vr[i]);
        if (SAMPLED || within(vr[i], Y0, NY)) show(s);
        else if (within(vr[i], D0, ND)) rate(s);
        else settle(s);
        value[i] = s->waiting && within(vr[i], U0, NU) ? s->given[vr[i] - U0] : s->v[vr[i]];
    }
    return fmi2OK;
}

#ifdef check_SZ_ARG
/* Whether a parameter is among variables. */
static int tunes(const fmi2ValueReference vr[], size_t n)
{
    size_t i;
    for (i = 0; i < n; i++)
        if (within(vr[i], P0, NP)) return 1;
    return 0;
}

/* Whether the conditions of parameters hold with new values; where they do not, it is said which. */
static int may_tune(Instance *it, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    State *s = &it->s;
    double before[NP + NC + 1];
    size_t i;
    int violated;
    memcpy(before, s->v, (NP + NC) * sizeof *before); /* p and c are the first of v */
    for (i = 0; i < n; i++)
        if (within(vr[i], P0, NP)) s->v[vr[i]] = value[i];
#ifdef calculate_SZ_ARG
    CALL(calculate, IN(P(s->v)), OUT(C(s->v)));
#endif
    violated = refuses(it, OF_PARAMETERS);
    memcpy(s->v, before, (NP + NC) * sizeof *before);
    return !violated;
}
#endif

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    size_t i;
    int when;
    ENTER("fmi2SetReal", INSTANTIATED | INITIALIZATION | STEPPING);
    NEED("fmi2SetReal", vr, n);
    NEED("fmi2SetReal", value, n);
    when = s->mode == STEPPING ? SET_BETWEEN : SET_BEFORE;
    for (i = 0; i < n; i++) { /* a refused call changes nothing */
        if (!within(vr[i], 0, NV)) return no_such_variable(it, "fmi2SetReal", vr[i]);
        if (!(variables[vr[i]].flags & when))
            return fail(it, "fmi2SetReal: variable %s cannot be set now.", name_of(vr[i]));
        if (!isfinite(value[i]))
            return fail(it, "fmi2SetReal: variable %s = %g is not finite.", name_of(vr[i]), value[i]);
    }
#ifdef check_SZ_ARG
    if (s->mode == STEPPING && tunes(vr, n) && !may_tune(it, vr, n, value)) return fmi2Error;
#endif
    for (i = 0; i < n; i++) {
        double *const place = s->waiting && within(vr[i], U0, NU) ? &s->given[vr[i] - U0] : &s->v[vr[i]];
        if (s->mode == STEPPING && same(place, &value[i], 1)) continue; /* nothing grows old of it */
        *place = value[i];
        s->start_old |= when == SET_BEFORE || within(vr[i], P0, NP) || s->waiting;
        s->y_old = s->d_old = s->dy_old = 1;
    }
#ifdef normalise_SZ_ARG
    if (s->mode == STEPPING && tunes(vr, n)) normalise_typed(it);
#endif
    return fmi2OK;
}

#define REAL_ONLY(function, type)                                                                                      \
    fmi2Status function(fmi2Component c, const fmi2ValueReference vr[], size_t n, type value[])                        \
    {                                                                                                                  \
        ENTER(#function, ANY);                                                                                         \
        (void)vr, (void)value;                                                                                         \
        return n ? fail(it, #function ": all variables of %s are Real.", MODEL_NAME) : fmi2OK;            \
    }
REAL_ONLY(fmi2GetInteger, fmi2Integer)
REAL_ONLY(fmi2SetInteger, const fmi2Integer)
REAL_ONLY(fmi2GetBoolean, fmi2Boolean)
REAL_ONLY(fmi2SetBoolean, const fmi2Boolean)
REAL_ONLY(fmi2GetString, fmi2String)
REAL_ONLY(fmi2SetString, const fmi2String)

/* ---- derivatives ------------------------------------------------------------------------------------------------ */

static int is_known(const State *s, fmi2ValueReference r)
{
    if (s->mode == INITIALIZATION) return within(r, 0, NV) && (variables[r].flags & SET_BEFORE);
    return within(r, U0, NU) || within(r, X0, NX);
}

static int is_unknown(const State *s, fmi2ValueReference r)
{
    if (within(r, Y0, NY) || within(r, D0, ND)) return 1;
    if (s->mode != INITIALIZATION) return within(r, X0, NX) && (variables[r].flags & OUTPUT);
    return within(r, C0, NC) || (within(r, X0, NX) && (variables[r].flags & (OUTPUT | SET_BEFORE)) != SET_BEFORE);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real dknown[],
                                        fmi2Real dunknown[])
{
    static const char function[] = "fmi2GetDirectionalDerivative";
    double seed[NV + 1] = {0}, result[NV + 1] = {0};
    size_t i;
    ENTER(function, INITIALIZATION | STEPPING | TERMINATED);
    NEED(function, unknown, n_unknown);
    NEED(function, known, n_known);
    NEED(function, dknown, n_known);
    NEED(function, dunknown, n_unknown);
    for (i = 0; i < n_known; i++) {
        if (!is_known(s, known[i]))
            return fail(it, "%s: %s is not a known %s.", function, name_of(known[i]), in_words(s->mode));
        seed[known[i]] += dknown[i];
    }
    for (i = 0; i < n_unknown; i++)
        if (!is_unknown(s, unknown[i]))
            return fail(it, "%s: %s is not an unknown %s.", function, name_of(unknown[i]), in_words(s->mode));
    settle(s);
    tangent(s, 0, seed, result);
    for (i = 0; i < n_unknown; i++) dunknown[i] = result[unknown[i]];
    return fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    static const char function[] = "fmi2SetRealInputDerivatives";
    size_t i;
    ENTER(function, INSTANTIATED | INITIALIZATION | STEPPING);
    NEED(function, vr, n);
    NEED(function, order, n);
    NEED(function, value, n);
    for (i = 0; i < n; i++) {
        if (!within(vr[i], U0, NU) || order[i] < 1 || order[i] > 3)
            return fail(it, "%s: variable %s, order %d: inputs, order 1 to 3 only.", function, name_of(vr[i]),
                        order[i]);
        if (!isfinite(value[i]))
            return fail(it, "%s: variable %s = %g is not finite.", function, name_of(vr[i]), value[i]);
    }
    if (!s->inputs_move) forget_input_derivatives(s);
    s->inputs_move = s->dy_old = 1;
    for (i = 0; i < n; i++) (order[i] == 1 ? s->u1 : order[i] == 2 ? s->u2 : s->u3)[vr[i] - U0] = value[i];
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    static const char function[] = "fmi2GetRealOutputDerivatives";
    double rates_of[NV + 1] = {0};
    size_t i;
    int of_outputs = 0;
    ENTER(function, STEPPING | TERMINATED);
    NEED(function, vr, n);
    NEED(function, order, n);
    NEED(function, value, n);
    for (i = 0; i < n; i++) {
        of_outputs |= within(vr[i], Y0, NY);
        if (!within(vr[i], 0, NV) || !(variables[vr[i]].flags & OUTPUT) || order[i] != 1 || SAMPLED)
            return fail(it, "%s: variable %s, order %d: %s.", function, name_of(vr[i]), order[i],
                          SAMPLED ? "sampled outputs have no derivatives" : "outputs, order 1 only");
    }
    slope(s, of_outputs, rates_of);
    for (i = 0; i < n; i++) value[i] = rates_of[vr[i]];
    return fmi2OK;
}

/* ---- step ------------------------------------------------------------------------------------------------------- */

#if SAMPLED
/* How far from t a sample is due there, s. Rounding parts what is meant to be one time: t0 + n T by eps/2 |n T| for T, as
 * much for the product, eps/2 |t| for the sum, t by eps/2 |t|: by no more than eps (2 |t| + |t0|), which passes 1 ns at
 * some 1e6 s. */
static double slack(const State *s, double t) { return TICK + 4 * DBL_EPSILON * fmax(fabs(t), fabs(s->t0)); }

/* Commit a sample that is due at the beginning of the step, take those inside it, see whether one is due at its end. */
static void sample_step(State *s, double t, double step)
{
    const double period = P(s->v)[SAMPLE_TIME];
    double u[NU + 1], tick;
    if (s->due) {
        if (P(s->v)[COMMIT_SHOWN] == 0) sample_at(s, t, U(s->v));
        memcpy(X(s->v), s->x_next, NX * sizeof u[0]);
        s->sample++;
    }
    while ((tick = s->t0 + (double)s->sample * period) < t + step - slack(s, t + step)) {
        inputs_at(s, tick - t, u);
        sample_at(s, tick, u);
        memcpy(X(s->v), s->x_next, NX * sizeof u[0]);
        s->sample++;
    }
    s->due = tick <= t + step + slack(s, t + step);
}
#elif NX
/* Put the rates at t, the begin of an internal step with inputs u, into k1; those that were shown last where these are
 * they. Held inputs are held on from here: g of them is made in any case. */
static void first_rate(State *s, double t, const double *u, double *k1)
{
    const int shown = !s->d_old && same(&t, &s->t, 1) && same(u, U(s->v), NU);
    if (!s->inputs_move) hold(s, &s->held, u, OUTPUTS_HELD ? ALL : OF_RATES);
    else if (!shown) hold(s, &s->held, u, OF_RATES);
    if (shown) memcpy(k1, D(s->v), NX * sizeof *k1);
    else CALL(rates, IN(&t, X(s->v), u, P(s->v), C(s->v), s->k, s->held.g), OUT(k1));
}

/* Advance the states by n equal internal steps; step means are the differences of their quantities over the step. */
static void integrate(State *s, double t, double step, int n)
{
    double x[NX], k1[NX], u[NU + 1], h = step / n;
    Held moved[2]; /* inputs that move, in the middle and at the end of an internal step */
    const Held *middle = &s->held, *end = &s->held;
    int i;
#ifdef means_SZ_ARG
    double before[NM], after[NM], t_end = t + step;
    CALL(means, IN(&t, X(s->v), P(s->v), C(s->v)), OUT(before));
#endif
    if (s->inputs_move) middle = &moved[0], end = &moved[1];
    for (i = 0; i < n; i++) {
        const double since = i * h;
        if (i == 0 || s->inputs_move) inputs_at(s, since, u);
        first_rate(s, t + since, u, k1);
        if (s->inputs_move) {
            moved[0].known = moved[1].known = NOTHING;
            inputs_at(s, since + h / 2, u);
            hold(s, &moved[0], u, OF_RATES);
            inputs_at(s, since + h, u);
            hold(s, &moved[1], u, OF_RATES);
        }
        CALL(advance, IN(&t, X(s->v), k1, middle->u, end->u, P(s->v), C(s->v), s->k, middle->g, end->g, &since, &h),
             OUT(x));
        memcpy(X(s->v), x, sizeof x);
        s->d_old = 1;
        if (s->inputs_move) s->held = moved[1]; /* where the next one begins, but for rounding */
    }
#ifdef means_SZ_ARG
    CALL(means, IN(&t_end, X(s->v), P(s->v), C(s->v)), OUT(after));
    for (i = 0; i < NM; i++) s->m[i] = (after[i] - before[i]) / step;
#endif
}
#endif

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real step, fmi2Boolean no_set_state_before)
{
    int i;
#if SAMPLED || NX
    double largest;
#endif
    ENTER("fmi2DoStep", STEPPING);
    (void)no_set_state_before;
    if (!(step > 0) || !isfinite(step)) return fail(it, "fmi2DoStep: step %g s is not positive.", step);
    if (!(fabs(t - s->t) <= TICK + 4 * DBL_EPSILON * fabs(t)))
        return fail(it, "fmi2DoStep: asked to start at %.17g s, the FMU is at %.17g s.", t, s->t);
    if (s->stop_defined && t + step > s->stop + TICK + 4 * DBL_EPSILON * fabs(s->stop))
        return fail(it, "fmi2DoStep: a step to %.17g s passes the stop time %.17g s.", t + step, s->stop);
    if (!s->inputs_move) forget_input_derivatives(s);
    settle(s);
#if CHECKS_INPUTS
    if (s->waiting && take_inputs(it) != fmi2OK) return fmi2Error;
#endif
#if SAMPLED || NX
#if SAMPLED
    largest = P(s->v)[SAMPLE_TIME];
#else
    largest = longest_internal_step(s);
#endif
    if (!(largest > 0) || step / largest > MOST_STEPS)
        return fail(it, "fmi2DoStep: %s = %g s does not suit a step of %g s.",
                    SAMPLED ? "sample_time" : "solver.step", largest, step);
#endif
#if SAMPLED
    sample_step(s, t, step);
#elif NX
    {
        /* A master's step is a difference of two times, each rounded: it may be longer than meant by some ulp of t. */
        const double n = ceil((step - 4 * DBL_EPSILON * (fabs(t) + step)) / largest - 1e-9);
        const double h = n > 1 ? step / n : step;
        if (it->internal_step.longest > 0 && h > it->internal_step.longest) warn_of_internal_step(it, h);
        integrate(s, t, step, n > 1 ? (int)n : 1);
        s->v[S0] = h;
    }
#endif
    if (s->inputs_move) { /* inputs stay where the extrapolation ends */
        double u[NU + 1];
        inputs_at(s, step, u);
        memcpy(U(s->v), u, NU * sizeof u[0]);
        for (i = 0; i < NU; i++) {
            s->u1[i] += step * (s->u2[i] + 0.5 * step * s->u3[i]);
            s->u2[i] += step * s->u3[i];
        }
        s->inputs_move = 0;
    }
    s->y_old = s->d_old = s->dy_old = 1;
    for (i = 0; i < NX; i++) {
        if (isfinite(X(s->v)[i])) continue;
        s->mode = FAILED; /* s->t stays the last successful time */
        return fail(it, "fmi2DoStep: state %s is not finite at %.9g s.", variables[X0 + i].name, t + step);
    }
    s->t = t + step;
    if (SAMPLED) show(s); /* before the inputs of the step's end are set: solver.commit_shown */
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    ENTER("fmi2CancelStep", ANY);
    return fail(it, "fmi2CancelStep: fmi2DoStep returns when the step is done, there is nothing to cancel.");
}

/* ---- status ----------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    ENTER("fmi2GetRealStatus", STEPPING | TERMINATED | FAILED);
    NEED("fmi2GetRealStatus", value, 1);
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = s->t;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    ENTER("fmi2GetBooleanStatus", STEPPING | TERMINATED | FAILED);
    NEED("fmi2GetBooleanStatus", value, 1);
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = fmi2False;
    return fmi2OK;
}

#define NO_STATUS(function, type)                                                                                      \
    fmi2Status function(fmi2Component c, const fmi2StatusKind kind, type *value)                                       \
    {                                                                                                                  \
        ENTER(#function, STEPPING | TERMINATED | FAILED);                                                              \
        NEED(#function, value, 1);                                                                                     \
        (void)kind;                                                                                                    \
        return fmi2Discard;                                                                                            \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetStringStatus, fmi2String)

/* ---- FMU state -------------------------------------------------------------------------------------------------- */

/* Refuse what is no state of this FMU. A pointer to anything else is read as far as its head goes. */
static fmi2Status known_state(const Instance *it, const char *function, const void *state)
{
    const Saved *saved = (const Saved *)state;
    if (!saved) return fail(it, "%s: there is no state.", function);
    if (memcmp(saved->magic, MAGIC, sizeof MAGIC) != 0)
        return fail(it, "%s: this is no state of an FMU of this kind.", function);
    if (saved->version != SAVED_VERSION || saved->size != sizeof *saved ||
        strncmp(saved->guid, MODEL_GUID, sizeof saved->guid) != 0)
        return fail(it, "%s: the state was saved by another FMU than %s, GUID %s.", function, MODEL_NAME, MODEL_GUID);
    return fmi2OK;
}

#define NEED_STATE(function, state)                                                                                    \
    do {                                                                                                               \
        if (known_state(it, function, state) != fmi2OK) return fmi2Error;                                              \
    } while (0)

/* Return the checksum (FNV-1a) of a state whose own is zero. One byte that is another always gives another checksum. */
static uint64_t checksum_of(const Saved *saved)
{
    const unsigned char *byte = (const unsigned char *)saved, *const end = byte + sizeof *saved;
    uint64_t sum = UINT64_C(14695981039346656037);
    for (; byte < end; byte++) sum = (sum ^ *byte) * UINT64_C(1099511628211);
    return sum;
}

/* Copy a state into *state, which is made where there is none yet. */
static fmi2Status keep(const Instance *it, const char *function, const State *s, fmi2FMUstate *state)
{
    Saved *saved;
    NEED(function, state, 1);
    if (*state) NEED_STATE(function, *state);
    saved = (Saved *)(*state ? *state : calloc(1, sizeof *saved));
    if (!saved) return fail(it, "%s: out of memory.", function);
    memcpy(saved->magic, MAGIC, sizeof MAGIC);
    saved->version = SAVED_VERSION;
    saved->size = (uint32_t)sizeof *saved;
    snprintf(saved->guid, sizeof saved->guid, "%s", MODEL_GUID);
    memcpy(&saved->s, s, sizeof *s);
    *state = saved;
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    ENTER("fmi2GetFMUstate", ANY);
    return keep(it, "fmi2GetFMUstate", s, state);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    ENTER("fmi2SetFMUstate", ANY);
    NEED_STATE("fmi2SetFMUstate", state);
    memcpy(s, &((const Saved *)state)->s, sizeof *s);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    ENTER("fmi2FreeFMUstate", ANY);
    if (!state || !*state) return fmi2OK; /* FMI: the call is ignored */
    NEED_STATE("fmi2FreeFMUstate", *state);
    memset(*state, 0, sizeof MAGIC); /* another pointer to it is no state any more */
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    ENTER("fmi2SerializedFMUstateSize", ANY);
    NEED_STATE("fmi2SerializedFMUstateSize", state);
    NEED("fmi2SerializedFMUstateSize", size, 1);
    *size = sizeof(Saved);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    Saved saved;
    ENTER("fmi2SerializeFMUstate", ANY);
    NEED_STATE("fmi2SerializeFMUstate", state);
    if (size < sizeof(Saved))
        return fail(it, "fmi2SerializeFMUstate: %lu bytes, needed are %lu.", (unsigned long)size,
                    (unsigned long)sizeof(Saved));
    NEED("fmi2SerializeFMUstate", bytes, size);
    memcpy(&saved, state, sizeof saved);
    saved.checksum = 0;
    saved.checksum = checksum_of(&saved);
    memcpy(bytes, &saved, sizeof saved); /* bytes may lie anywhere */
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    static const char function[] = "fmi2DeSerializeFMUstate";
    Saved saved;
    uint64_t checksum;
    ENTER(function, ANY);
    NEED(function, bytes, size);
    memset(&saved, 0, sizeof saved);
    memcpy(&saved, bytes, size < sizeof saved ? size : sizeof saved);
    NEED_STATE(function, &saved);
    if (size != sizeof saved) return fail(it, "%s: %lu bytes, needed are %lu.", function, (unsigned long)size,
                                          (unsigned long)sizeof saved);
    checksum = saved.checksum;
    saved.checksum = 0;
    if (checksum != checksum_of(&saved))
        return fail(it, "%s: the bytes are damaged: their checksum is another.", function);
    return keep(it, function, &saved.s, state);
}
