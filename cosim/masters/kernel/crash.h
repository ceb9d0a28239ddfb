/* What is told when an FMU ends the process: a line on standard error, and the end of run.json.
 *
 * The handlers look up where the thread is (its Breadcrumb), write, and leave the rest to whoever handled the signal
 * before. They call nothing that may wait for a lock, for the FMU may have died with one. */
#if !defined(_WIN32)
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

enum { SIGNALS = 5, LONGEST = 1000, STACK = 65536 };
static const int signals[SIGNALS] = {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL};
static const char *const signal_names[SIGNALS] = {
    "SIGSEGV, a segmentation fault", "SIGABRT, abort() was called", "SIGBUS, a bus error",
    "SIGFPE, an arithmetic error", "SIGILL, an illegal instruction"};
static struct sigaction handled_before[SIGNALS];
static const Breadcrumb *breadcrumbs;
static integer breadcrumb_count;

/* ---- text ------------------------------------------------------------------------------------------------------- */

typedef struct {
    char text[4 * LONGEST];
    size_t length;
} Line;

/* Add a text, its first LONGEST bytes and no part of a character; `quoted`: as it can stand in a string of JSON. */
static void put(Line *line, const char *text, int quoted)
{
    size_t n = strlen(text), i;
    if (n > LONGEST)
        for (n = LONGEST; n && ((unsigned char)text[n] & 0xC0) == 0x80;) n--;
    for (i = 0; i < n && line->length < sizeof line->text; i++) {
        const char c = text[i];
        line->text[line->length++] = (char)((quoted && (c == '"' || c == '\\')) || (unsigned char)c < ' ' ? '\'' : c);
    }
}

static void put_digits(Line *line, unsigned long long number, int least)
{
    char digits[24];
    int n = (int)sizeof digits - 1;
    digits[n] = 0;
    for (; number || least > 0; number /= 10, least--) digits[--n] = (char)('0' + number % 10);
    put(line, digits + n, 0);
}

/* Add a time to a nanosecond, without the zeros at its end. */
static void put_time(Line *line, double time)
{
    const double size = fabs(time);
    unsigned long long whole, billionth;
    int places = 9;
    if (!(size < 1e18)) {
        put(line, "0", 0);
        return;
    }
    whole = (unsigned long long)size;
    billionth = (unsigned long long)((size - (double)whole) * 1e9 + 0.5);
    if (billionth >= 1000000000ULL) whole++, billionth = 0;
    if (time < 0) put(line, "-", 0);
    put_digits(line, whole, 1);
    if (!billionth) return;
    for (; billionth % 10 == 0; billionth /= 10) places--;
    put(line, ".", 0);
    put_digits(line, billionth, places);
}

/* ---- where ------------------------------------------------------------------------------------------------------ */

typedef struct {
    const char *instance, *function;
    double time;
} Place;

static const char *function_name(integer call, integer kind)
{
    static const char *const set[] = {"fmi2SetReal", "fmi2SetInteger", "fmi2SetBoolean", "fmi2SetString"};
    static const char *const get[] = {"fmi2GetReal", "fmi2GetInteger", "fmi2GetBoolean", "fmi2GetString"};
    switch (call) {
    case CALL_SET: return set[kind];
    case CALL_GET: return get[kind];
    case CALL_SET_DERIVATIVES: return "fmi2SetRealInputDerivatives";
    case CALL_GET_DERIVATIVES: return "fmi2GetRealOutputDerivatives";
    case CALL_GET_STATE: return "fmi2GetFMUstate";
    case CALL_SET_STATE: return "fmi2SetFMUstate";
    default: return "fmi2DoStep";
    }
}

/* The breadcrumb of the thread that is running, NULL outside FMUs. A child that an FMU has forked is not ours. */
static const Breadcrumb *find_place(Place *place)
{
    const Breadcrumb *b = breadcrumbs;
    integer i;
    for (i = 0; i < breadcrumb_count; i++, b++) {
        if (b->thread != (integer)pthread_self() || b->process != (integer)getpid()) continue;
        if (b->run && b->run->calling) {
            const integer calling = b->run->calling;
            const Component *c = &b->run->component[CALLING_COMPONENT(calling)];
            place->instance = c->name;
            place->function = function_name(CALLING_CALL(calling), CALLING_KIND(calling));
            if (c->do_step == fmi3_do_step) place->function = ((const Fmi3 *)c->instance)->function;
            place->time = point_time(b->run, b->run->done);
            return b;
        }
        if (b->function) {
            place->instance = b->instance;
            place->function = b->function;
            place->time = b->time;
            return b;
        }
    }
    return NULL;
}

static void put_story(Line *line, const Place *place, const char *how)
{
    put(line, place->instance, 1);
    put(line, " ended the process in ", 0);
    put(line, place->function, 0);
    if (!isnan(place->time)) {
        put(line, " at communication point ", 0);
        put_time(line, place->time);
        put(line, " s", 0);
    }
    put(line, ": ", 0);
    put(line, how, 0);
    put(line, ".", 0);
}

static void tell(const Breadcrumb *b, const Place *place, const char *how)
{
    Line line;
    ssize_t written;
    line.length = 0;
    put(&line, "FmuCrashed: ", 0);
    put_story(&line, place, how);
    if (b->rows) {
        put(&line, " The rows that were written before are in ", 0);
        put(&line, b->rows, 0);
        put(&line, ".", 0);
    }
    put(&line, " Fly another FMU in its place (--use INSTANCE=FMU).", 0);
    line.text[line.length < sizeof line.text ? line.length++ : line.length - 1] = '\n';
    written = write(STDERR_FILENO, line.text, line.length);
    if (b->file >= 0) {
        line.length = 0;
        put(&line, "\"crashed\", \"error\": \"FmuCrashed\", \"why\": \"", 0);
        put_story(&line, place, how);
        put(&line, "\", \"failure\": {\"component\": \"", 0);
        put(&line, place->instance, 1);
        put(&line, "\", \"function\": \"", 0);
        put(&line, place->function, 0);
        put(&line, "\", \"time\": ", 0);
        if (isnan(place->time)) put(&line, "null", 0);
        else put_time(&line, place->time);
        put(&line, "}", 0);
        written = pwrite((int)b->file, line.text, line.length, (off_t)b->at); /* into blanks, see results/story.py */
    }
    (void)written;
}

/* ---- handlers --------------------------------------------------------------------------------------------------- */

static void on_signal(int number, siginfo_t *info, void *context)
{
    static volatile sig_atomic_t told;
    const struct sigaction *before;
    const Breadcrumb *b;
    Place place;
    int i = 0;
    while (i < SIGNALS - 1 && signals[i] != number) i++;
    before = &handled_before[i];
    b = told ? NULL : find_place(&place);
    if (b) {
        told = 1;
        tell(b, &place, signal_names[i]);
    }
    if (before->sa_flags & SA_SIGINFO) {
        before->sa_sigaction(number, info, context);
    } else if (before->sa_handler != SIG_DFL && before->sa_handler != SIG_IGN) {
        before->sa_handler(number);
    } else {
        sigaction(number, before, NULL);
        raise(number); /* it comes when this returns */
    }
}

static void on_exit_of_process(void)
{
    Place place;
    const Breadcrumb *b = find_place(&place);
    if (!b) return; /* the program's own end */
    tell(b, &place, "it called exit()");
    _exit(1);
}

/* From now on tell of crashes in a thread that has one of `count` breadcrumbs. */
EXPORT void kernel_tell_crashes(const Breadcrumb *first, integer count)
{
    struct sigaction ours;
    int i;
    breadcrumbs = first;
    breadcrumb_count = count;
    memset(&ours, 0, sizeof ours);
    ours.sa_sigaction = on_signal;
    ours.sa_flags = SA_SIGINFO | SA_ONSTACK;
    sigemptyset(&ours.sa_mask);
    for (i = 0; i < SIGNALS; i++) sigaction(signals[i], &ours, &handled_before[i]);
    atexit(on_exit_of_process);
}

/* Give this thread a stack for its handlers, for it may have run out of its own; NULL: it has one. */
EXPORT void *kernel_take_stack(void)
{
    stack_t stack;
    if (sigaltstack(NULL, &stack) || !(stack.ss_flags & SS_DISABLE)) return NULL;
    memset(&stack, 0, sizeof stack);
    stack.ss_sp = malloc(STACK);
    stack.ss_size = STACK;
    if (stack.ss_sp && sigaltstack(&stack, NULL)) {
        free(stack.ss_sp);
        return NULL;
    }
    return stack.ss_sp;
}

EXPORT void kernel_give_stack_back(void *stack)
{
    stack_t none;
    if (!stack) return;
    memset(&none, 0, sizeof none);
    none.ss_flags = SS_DISABLE;
    sigaltstack(&none, NULL);
    free(stack);
}
#else
/* Windows has no signals of this kind: a crash is told by the system. */
EXPORT void kernel_tell_crashes(const Breadcrumb *first, integer count) { (void)first, (void)count; }
EXPORT void *kernel_take_stack(void) { return NULL; }
EXPORT void kernel_give_stack_back(void *stack) { (void)stack; }
#endif
