/* The values of a wave: whether they are finite, and how they come to be seen at the communication point. */

#if defined(__GNUC__)
#define RARELY(condition) __builtin_expect(!!(condition), 0)
#else
#define RARELY(condition) (condition)
#endif

#define EXPONENT 0x7ff0000000000000LL /* all these bits of a double are set where it is not finite */

enum { FEW = 16 }; /* so few values are taken one by one: wider loads would wait for what has just been written */

/* Has its first bit set where one of the values that must be finite is not: one more carries. */
#define NOT_FINITE(bits, mask) ((unsigned long long)((bits) & (mask)) + (1ull << 52))
#define BITS(value) (*(const volatile integer *)&(value))

static inline int any_not_finite(const Wave *w)
{
    const integer *mask = w->finite, *value = (const integer *)w->value;
    unsigned long long carried = 0;
    integer i;
    if (w->slots < FEW)
        for (i = 0; i < w->slots; i++) carried |= NOT_FINITE(BITS(value[i]), mask[i]);
    else
        for (i = 0; i < w->slots; i++) carried |= NOT_FINITE(value[i], mask[i]);
    return (int)(carried >> 63);
}

static inline void show_all(const Run *r)
{
    const double *newest = r->newest;
    double *point = r->point;
    integer i;
    if (r->owned < FEW)
        for (i = 0; i < r->owned; i++) ((volatile double *)point)[i] = newest[i];
    else
        memcpy(point, newest, (size_t)r->owned * sizeof *point);
}
