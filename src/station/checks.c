/* checks.c - a list, one of each tile and port. */
#include "station/checks.h"

#include <stdlib.h>
#include <string.h>

struct checked *checked_make(const struct store_check *check)
{
    struct checked *made = calloc(1, sizeof *made);
    if (made == NULL)
        return NULL;
    made->seq = check->seq;
    memcpy(made->id, check->id, sizeof made->id);
    memcpy(made->tile, check->tile, sizeof made->tile);
    memcpy(made->taken_at, check->taken_at, sizeof made->taken_at);
    made->aperture_mm = check->aperture_mm;
    made->dE00 = check->dE00;
    made->limit_dE00 = check->limit_dE00;
    made->passed = check->passed;
    return made;
}

void checks_note(struct checks *checks, struct checked *checked)
{
    struct checked **at = &checks->first;
    while (*at != NULL &&
           ((*at)->aperture_mm != checked->aperture_mm || strcmp((*at)->tile, checked->tile) != 0))
        at = &(*at)->next;
    struct checked *before = *at;
    if (before != NULL && before->seq >= checked->seq) {
        free(checked);
        return;
    }
    checked->next = before != NULL ? before->next : NULL;
    *at = checked;
    free(before);
}

void checks_forget(struct checks *checks)
{
    while (checks->first != NULL) {
        struct checked *next = checks->first->next;
        free(checks->first);
        checks->first = next;
    }
}

static bool comes_before(const struct checked *a, const struct checked *b)
{
    return a->passed != b->passed ? !a->passed : a->seq > b->seq;
}

const struct checked *checks_shown(const struct checks *checks, double aperture_mm)
{
    const struct checked *shown = NULL;
    for (const struct checked *one = checks->first; one != NULL; one = one->next)
        if (one->aperture_mm == aperture_mm && (shown == NULL || comes_before(one, shown)))
            shown = one;
    return shown;
}

bool checks_drift(const struct checks *checks, double aperture_mm)
{
    const struct checked *shown = checks_shown(checks, aperture_mm);
    return shown != NULL && !shown->passed;
}
