/* cie_names.c - names of illuminants and observers, as people write them. */
#include "colour/cie_tables.h"

#include <stdbool.h>
#include <stddef.h>

static const char *const illuminant_names[ILLUMINANT_COUNT] = {
    [ILLUMINANT_A] = "A",       [ILLUMINANT_C] = "C",           [ILLUMINANT_D50] = "D50",
    [ILLUMINANT_D55] = "D55",   [ILLUMINANT_D65] = "D65",       [ILLUMINANT_D75] = "D75",
    [ILLUMINANT_E] = "E",       [ILLUMINANT_FL2] = "FL2",       [ILLUMINANT_FL7] = "FL7",
    [ILLUMINANT_FL11] = "FL11", [ILLUMINANT_LED_B3] = "LED-B3",
};

static const char *const observer_names[OBSERVER_COUNT] = {
    [OBSERVER_2DEG] = "2",
    [OBSERVER_10DEG] = "10",
};

/* ASCII only, so that the answer does not depend on the locale. */
static char upper(char c)
{
    return c >= 'a' && c <= 'z' ? (char)(c - 'a' + 'A') : c;
}

static bool same_name(const char *a, const char *b)
{
    while (*a != '\0' && upper(*a) == upper(*b)) {
        a++;
        b++;
    }
    return upper(*a) == upper(*b);
}

const char *illuminant_name(enum illuminant illuminant)
{
    return (size_t)illuminant < ILLUMINANT_COUNT ? illuminant_names[illuminant] : "unknown";
}

const char *observer_name(enum observer observer)
{
    return (size_t)observer < OBSERVER_COUNT ? observer_names[observer] : "unknown";
}

enum status illuminant_parse(const char *text, enum illuminant *ret)
{
    for (int i = 0; i < ILLUMINANT_COUNT; i++) {
        if (same_name(text, illuminant_names[i])) {
            *ret = (enum illuminant)i;
            return STATUS_OK;
        }
    }
    return STATUS_NOT_FOUND;
}

enum status observer_parse(const char *text, enum observer *ret)
{
    for (int i = 0; i < OBSERVER_COUNT; i++) {
        if (same_name(text, observer_names[i])) {
            *ret = (enum observer)i;
            return STATUS_OK;
        }
    }
    return STATUS_NOT_FOUND;
}
