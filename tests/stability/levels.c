/* levels.c - each set of outputs: their number, then these. */
#include "tests/stability/levels.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "tests/stability/rooms.h"
#include "tests/stability/whole.h"

/* ---- every set, one after the other ------------------------------------------------- */

/* A study or a whole; past the last both are NULL. */
struct set {
    const struct study *study;
    const struct whole *whole;
};

static struct set set_at(size_t i)
{
    for (size_t room = 0; room < study_room_count; room++) {
        if (i < study_rooms[room]->n)
            return (struct set){ &study_rooms[room]->studies[i], NULL };
        i -= study_rooms[room]->n;
    }
    return (struct set){ NULL, i < whole_count ? &whole_list[i] : NULL };
}

static bool is_set(const struct set *set)
{
    return set->study != NULL || set->whole != NULL;
}

static const char *name_of(const struct set *set)
{
    return set->study != NULL ? set->study->name : set->whole->name;
}

static double *outputs_of(const struct set *set, uint64_t *n)
{
    return set->study != NULL ? study_outputs(set->study, n) : set->whole->outputs(n);
}

/* ---- files -------------------------------------------------------------------------- */

int levels_write(const char *path)
{
    FILE *file = fopen(path, "wb");
    bool good = file != NULL;
    struct set set;
    for (size_t i = 0; good && (set = set_at(i), is_set(&set)); i++) {
        uint64_t n;
        double *all = outputs_of(&set, &n);
        good = all != NULL && fwrite(&n, sizeof n, 1, file) == 1 &&
               fwrite(all, sizeof *all, n, file) == n;
        free(all);
    }
    if (file != NULL && fclose(file) != 0)
        good = false;
    if (!good)
        perror(path);
    return good ? 0 : 1;
}

static double *read_outputs(FILE *file, uint64_t *n)
{
    if (fread(n, sizeof *n, 1, file) != 1)
        return NULL;
    double *all = malloc((*n + 1) * sizeof *all);
    if (all != NULL && fread(all, sizeof *all, *n, file) != *n) {
        free(all);
        return NULL;
    }
    return all;
}

/* ---- differences -------------------------------------------------------------------- */

double levels_ulp(double a, double b)
{
    if (a == b || (isnan(a) && isnan(b)) || (fabs(a) < 1e-300 && fabs(b) < 1e-300))
        return 0.0;
    if (!isfinite(a) || !isfinite(b))
        return INFINITY;
    int exponent;
    (void)frexp(fmax(fabs(a), fabs(b)), &exponent);
    return fabs(a - b) / ldexp(1.0, exponent - 53);
}

/* The next set of both files; false where they do not both hold as much of it. */
static bool compare_set(FILE *a, FILE *b, double *most, uint64_t *n)
{
    uint64_t m = 0;
    double *x = read_outputs(a, n), *y = read_outputs(b, &m);
    bool good = x != NULL && y != NULL && *n == m;
    *most = 0.0;
    for (size_t k = 0; good && k < m; k++)
        *most = fmax(*most, levels_ulp(x[k], y[k]));
    free(x);
    free(y);
    return good;
}

static bool compare_files(FILE *a, FILE *b, double *worst, size_t *total)
{
    struct set set;
    for (size_t i = 0; set = set_at(i), is_set(&set); i++) {
        uint64_t n = 0;
        double most;
        if (!compare_set(a, b, &most, &n)) {
            fprintf(stderr, "stability: other numbers of outputs: %s\n", name_of(&set));
            return false;
        }
        if (most > 0.0)
            printf("  %s: %g ulp\n", name_of(&set), most);
        *worst = fmax(*worst, most);
        *total += n;
    }
    return true;
}

int levels_compare(const char *path_a, const char *path_b)
{
    FILE *a = fopen(path_a, "rb"), *b = fopen(path_b, "rb");
    double worst = 0.0;
    size_t total = 0;
    bool good = a != NULL && b != NULL && compare_files(a, b, &worst, &total);
    if (a != NULL)
        (void)fclose(a);
    if (b != NULL)
        (void)fclose(b);
    if (!good) {
        fprintf(stderr, "stability: %s and %s do not hold the same studies\n", path_a, path_b);
        return 1;
    }
    printf("  %s, %s: %zu numbers, largest difference %g ulp\n", path_a, path_b, total, worst);
    return worst > 0.0;
}
