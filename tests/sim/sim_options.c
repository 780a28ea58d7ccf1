/* sim_options.c - take "key=value,..." apart. */
#include "tests/sim/sim_options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool set(const char *kind, const struct sim_option *o, const char *value, size_t n)
{
    char text[SIM_OPTION_SIZE], *end;
    if (n >= sizeof text) {
        fprintf(stderr, "%s: option %s is longer than %zu bytes\n", kind, o->key, sizeof text - 1);
        return false;
    }
    memcpy(text, value, n);
    text[n] = '\0';
    if (o->text != NULL) {
        memcpy(o->text, text, n + 1);
        return true;
    }
    double x = strtod(text, &end);
    if (n == 0 || *end != '\0' || !(x >= o->min && x <= o->max)) {
        fprintf(stderr, "%s: option %s=%s has to be a number %g to %g\n", kind, o->key, text,
                o->min, o->max);
        return false;
    }
    *o->number = x;
    return true;
}

bool sim_options_read(const char *kind, const char *options, const struct sim_option *list)
{
    while (*options != '\0') {
        size_t n = strcspn(options, ","), key = strcspn(options, "=,");
        const struct sim_option *o = list;
        while (o->key != NULL && (strlen(o->key) != key || strncmp(o->key, options, key) != 0))
            o++;
        if (o->key == NULL || key == n) {
            fprintf(stderr, "%s: no such option as %.*s\n", kind, (int)n, options);
            return false;
        }
        if (!set(kind, o, options + key + 1, n - key - 1))
            return false;
        options += options[n] == ',' ? n + 1 : n;
    }
    return true;
}

bool sim_options_value(const char *options, const char *key, char *value, size_t size)
{
    size_t length = strlen(key);
    for (; *options != '\0'; options += strcspn(options, ","), options += *options == ',') {
        if (strncmp(options, key, length) != 0 || options[length] != '=')
            continue;
        size_t n = strcspn(options + length + 1, ",");
        n = n < size ? n : size - 1;
        memcpy(value, options + length + 1, n);
        value[n] = '\0';
        return true;
    }
    return false;
}
