/* A step that is repeated until what is exchanged agrees: cosim/masters/implicit/ in C, operation by operation. What takes
 * more than Newton's method with the Jacobian at hand (a new Jacobian, a shorter step, a component that fails) is left to
 * Python: everything is taken back to where the step began, and r->stuck says so. */

enum { MOST = 24, PATIENCE = 2 }; /* newton.py */
static const double SLOW = 0.5;   /* newton.py */

static int save_state(Run *r, integer place)
{
    Component *c = &r->component[place];
    calling(r, place, CALL_GET_STATE, REAL);
    return returned(r, c->get_state(c->instance, &c->state));
}

static int restore_state(Run *r, integer place)
{
    Component *c = &r->component[place];
    calling(r, place, CALL_SET_STATE, REAL);
    return returned(r, c->set_state(c->instance, c->state));
}

static void free_states(Run *r)
{
    integer i;
    for (i = 0; i < r->components; i++) {
        Component *c = &r->component[i];
        if (c->state) c->free_state(c->instance, &c->state);
        c->state = NULL;
    }
}

/* Solve `a` x = right in place, x in `right`; 0 where it is singular. linear.py: solve */
static int solve(integer n, double *a, double *right)
{
    integer i, j, k;
    for (j = 0; j < n; j++) {
        integer pivot = j;
        double factor;
        for (i = j; i < n; i++) {
            if (isnan(a[i * n + j])) return 0;
            if (fabs(a[i * n + j]) > fabs(a[pivot * n + j])) pivot = i;
        }
        if (!isfinite(a[pivot * n + j]) || a[pivot * n + j] == 0) return 0;
        if (pivot != j) {
            for (k = 0; k < n; k++) {
                const double swap = a[j * n + k];
                a[j * n + k] = a[pivot * n + k];
                a[pivot * n + k] = swap;
            }
            factor = right[j];
            right[j] = right[pivot];
            right[pivot] = factor;
        }
        for (i = j + 1; i < n; i++) {
            factor = a[i * n + j] / a[j * n + j];
            for (k = j; k < n; k++) a[i * n + k] -= factor * a[j * n + k];
            right[i] -= factor * right[j];
        }
    }
    for (j = n - 1; j >= 0; j--) {
        right[j] = right[j] / a[j * n + j];
        for (i = 0; i < j; i++) right[i] -= a[i * n + j] * right[j];
    }
    return 1;
}

/* J + f s^T / s^T s, s not zero: with that the step before was accepted. linear.py: broyden */
static void broyden(integer n, double *jacobian, const double *residual, const double *change)
{
    double square = 0;
    integer i, j;
    for (i = 0; i < n; i++) square += change[i] * change[i];
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) jacobian[i * n + j] = jacobian[i * n + j] + residual[i] / square * change[j];
}

/* A guess of the unknowns at the end of the step. newton.py: predict */
static void predict(const Run *r, const Loop *loop, const double *memory, double h)
{
    const double step = memory[0], *before = memory + 2;
    integer i;
    for (i = 0; i < loop->values; i++) {
        const integer j = loop->partner[i];
        const double now = r->point[loop->slots[i]];
        if (j < 0) {
            loop->x[i] = step != 0 ? now + (now - before[i]) * h / step : now;
        } else {
            const double slope = r->point[loop->slots[j]];
            if (step == 0 || isnan(before[j]) || isnan(slope)) {
                loop->x[j] = slope_or_none(slope);
                loop->x[i] = now + h * loop->x[j];
            } else {
                const Ends e = {before[i], now, before[j], slope};
                loop->x[i] = curve_value(e, step, step + h);
                loop->x[j] = curve_slope(e, step, step + h);
            }
        }
    }
}

/* The largest part of a change. newton.py: size */
static double size_of(const Loop *loop, double h)
{
    double largest = 0;
    integer i;
    for (i = 0; i < loop->unknowns; i++) {
        const double weight = loop->nominal[i] + fabs(loop->x[loop->value[i]]);
        const double part = (loop->slope[i] ? h : 1.0) * fabs(loop->change[i]) / weight;
        if (isnan(part)) return part;
        if (part > largest) largest = part;
    }
    return largest;
}

/* Step the members of a loop with its unknowns, from where the step began; the residual is what they then are, less. */
static int evaluate(Run *r, Loop *loop, integer k, double t, double h, int stepped)
{
    integer i;
    for (i = 0; i < loop->members && stepped; i++)
        if (restore_state(r, loop->first + i)) return 1;
    r->evaluations++;
    for (i = 0; i < loop->unknowns; i++) r->newest[loop->slots[i]] = loop->x[i];
    for (i = 0; i < loop->members; i++) pass_on(r, &r->component[loop->first + i], t + h);
    for (i = 0; i < loop->members; i++)
        if (take_turn(r, loop->first + i, k, t, h)) return 1;
    for (i = 0; i < loop->unknowns; i++) loop->residual[i] = r->newest[loop->slots[i]] - loop->x[i];
    return 0;
}

/* Find the unknowns of a loop; 1 where that takes more. newton.py: find */
static int find(Run *r, Loop *loop, integer k, double t, double h)
{
    const integer n = loop->unknowns;
    double *memory = r->memory_next + loop->memory, *jacobian = memory + 2 + n, last = INFINITY;
    int slow = 0, stepped;
    integer i;
    if (memory[1] == 0) return 1;
    predict(r, loop, memory, h);
    for (stepped = 0; stepped < MOST; stepped++) {
        double found;
        if (evaluate(r, loop, k, t, h, stepped)) return 1;
        for (i = 0; i < n; i++)
            if (!isfinite(loop->residual[i])) return 1;
        if (stepped) broyden(n, jacobian, loop->residual, loop->change);
        memcpy(loop->matrix, jacobian, (size_t)(n * n) * sizeof(double));
        for (i = 0; i < n; i++) loop->change[i] = -loop->residual[i];
        if (!solve(n, loop->matrix, loop->change)) return 1;
        found = size_of(loop, h);
        if (found <= r->tolerance) {
            memory[0] = h;
            for (i = 0; i < n; i++) memory[2 + i] = r->point[loop->slots[i]];
            return 0;
        }
        slow += found > SLOW * last;
        last = found;
        if (slow >= PATIENCE) return 1;
        for (i = 0; i < n; i++) loop->x[i] = loop->x[i] + loop->change[i];
    }
    return 1;
}

/* Communication step k, from t to t + h; 1 where a call has failed for good, or r->stuck. iterating.py: attempt */
static int iterated_step(Run *r, integer k, double t, double h)
{
    const integer evaluations = r->evaluations;
    double *swap;
    integer i;
    int more = 0;
    memcpy(r->newest, r->point, (size_t)r->size * sizeof(double));
    memcpy(r->memory_next, r->memory, (size_t)r->memory_size * sizeof(double));
    for (i = 0; i < r->components; i++)
        if (save_state(r, i)) return 1;
    for (i = 0; i < r->stages && !more; i++) {
        const integer stage = r->stage[i];
        more = stage >= 0 ? take_turn(r, stage, k, t, h) : find(r, &r->loop[-1 - stage], k, t, h);
    }
    if (!more) {
        memcpy(r->point, r->newest, (size_t)r->owned * sizeof(double));
        swap = r->memory, r->memory = r->memory_next, r->memory_next = swap;
        return 0;
    }
    if (r->failed_call != CALL_NONE && (r->failed_status == FATAL || r->failed_status == PENDING)) return 1;
    r->failed_call = CALL_NONE;
    for (i = 0; i < r->components; i++)
        if (restore_state(r, i)) return 1;
    memcpy(r->newest, r->point, (size_t)r->size * sizeof(double));
    r->evaluations = evaluations;
    r->stuck = 1;
    return 1;
}

/* Take one step of length h from t, of which the points know nothing; 1 where a call has failed for good, or r->stuck. */
EXPORT int kernel_attempt(Run *r, double t, double h)
{
    const int failed = has_ended(r) || iterated_step(r, r->done, t, h);
    free_states(r);
    r->calling = 0;
    return failed;
}
