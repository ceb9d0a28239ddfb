/* When: the clock on the wall, the communication points, and the periods of components. */
#if defined(_WIN32)
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#else
#include <time.h>
#endif

static double now(void)
{
#if defined(_WIN32)
    LARGE_INTEGER count, frequency;
    QueryPerformanceCounter(&count);
    QueryPerformanceFrequency(&frequency);
    return (double)count.QuadPart / (double)frequency.QuadPart;
#else
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
#endif
}

/* Communication point k in units of 1/denominator s, and in s, rounded once. */
static integer point_count(const Run *r, integer k)
{
    integer i = 0, at;
    while (i < r->divisions && r->divided_at[i] < k) i++;
    if (i < r->divisions && r->divided_at[i] == k) return r->dividing[i];
    at = r->start + (k - i) * r->step;
    return at < r->stop ? at : r->stop;
}

/* The next point after k that is recorded: time.py, Schedule.recorded. */
static integer next_recorded(const Run *r, integer k)
{
    integer i, before = 0, after, next; /* after: the last point of the grid to k that is recorded */
    for (i = 0; i < r->divisions; i++) before += r->divided_at[i] <= k;
    after = (k - before) / r->every * r->every;
    if (r->every >= r->steps - after) {
        next = r->steps;
    } else {
        next = after + r->every;
        for (i = 0; i < r->divisions && r->divided_at[i] <= next; i++) next++;
        if (next > r->steps) next = r->steps;
    }
    for (i = 0; i < r->events; i++)
        if (r->event_point[i] > k && r->event_point[i] < next) next = r->event_point[i];
    return next;
}

static double point_time(const Run *r, integer k) { return (double)point_count(r, k) / (double)r->denominator; }

static integer period_start(const Component *c, integer k) { return c->period == 1 ? k : k - k % c->period; }

static integer period_end(const Run *r, const Component *c, integer k)
{
    integer start = period_start(c, k);
    return c->period < r->steps - start ? start + c->period : r->steps;
}

static int is_due(const Run *r, const Component *c, integer k)
{
    if (c->period == 1) return 1;
    return c->at_end ? k + 1 == period_end(r, c, k) : k == period_start(c, k);
}
