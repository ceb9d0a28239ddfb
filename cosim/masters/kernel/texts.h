/* The distinct texts of a run: a slot of a String holds the number of its text, in the order in which they came up. */
#include <stdlib.h>
#include <string.h>

static integer hash(const char *text, integer places)
{
    unsigned long long h = 1469598103934665603ULL;
    for (; *text; text++) h = (h ^ (unsigned char)*text) * 1099511628211ULL;
    return (integer)(h & (unsigned long long)(places - 1));
}

/* Make room for one text more; 0: out of memory, and nothing has changed. */
static int grow(Texts *t)
{
    integer places = t->places ? 2 * t->places : 64, i;
    integer *place;
    char **text;
    if (2 * (t->count + 1) <= t->places && t->count < t->capacity) return 1;
    text = realloc(t->text, (size_t)places * sizeof *text);
    if (!text) return 0;
    t->text = text;
    t->capacity = places;
    place = malloc((size_t)places * sizeof *place);
    if (!place) return 0;
    for (i = 0; i < places; i++) place[i] = -1;
    for (i = 0; i < t->count; i++) {
        integer at = hash(t->text[i], places);
        while (place[at] >= 0) at = (at + 1) & (places - 1);
        place[at] = i;
    }
    free(t->place);
    t->place = place;
    t->places = places;
    return 1;
}

/* The number of a text, a new one for a new text; -1: out of memory. NULL is the empty text. */
EXPORT integer kernel_text_number(Texts *t, const char *text)
{
    integer at;
    size_t size;
    char *copy;
    if (!text) text = "";
    if (!grow(t)) return -1;
    for (at = hash(text, t->places); t->place[at] >= 0; at = (at + 1) & (t->places - 1))
        if (strcmp(t->text[t->place[at]], text) == 0) return t->place[at];
    size = strlen(text) + 1;
    copy = malloc(size);
    if (!copy) return -1;
    memcpy(copy, text, size);
    t->text[t->count] = copy;
    t->place[at] = t->count;
    return t->count++;
}

EXPORT Texts *kernel_texts(void) { return calloc(1, sizeof(Texts)); }

EXPORT const char *kernel_text(const Texts *t, integer number) { return t->text[number]; }

EXPORT integer kernel_text_count(const Texts *t) { return t->count; }

EXPORT void kernel_free_texts(Texts *t)
{
    integer i;
    if (!t) return;
    for (i = 0; i < t->count; i++) free(t->text[i]);
    free(t->text);
    free(t->place);
    free(t);
}
