/* map_rate.c - what a map can at best be as fast as: the same fits, of spectra in memory.
 *
 *     map_rate CUBE.bip MODEL three|skin WHITE BANDS THREADS
 *
 * CUBE.bip: float32 of this machine's byte order, bands from 400 nm by 10, a pixel's together.
 * Prints pixels, and seconds of wall clock and of all threads' CPU for them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "match/refine_many.h"
#include "match/refined_match.h"

static double seconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static float *read_all(const char *path, size_t bands, size_t *n)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL || fseek(file, 0, SEEK_END) != 0)
        return NULL;
    long size = ftell(file);
    rewind(file);
    float *all = size > 0 ? malloc((size_t)size) : NULL;
    *n = (size_t)size / sizeof *all / bands;
    if (all != NULL && fread(all, bands * sizeof *all, *n, file) != *n)
        exit(EXIT_FAILURE);
    fclose(file);
    return all;
}

/* Room for what a map shows. */
static struct refine_answers answers(const struct fit *fit, size_t n)
{
    struct refine_answers a = { .rms = calloc(n, sizeof(double)),
                                .flags = calloc(n, sizeof(uint32_t)) };
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        if (!fit->role[i].free)
            continue;
        a.value[i] = calloc(n, sizeof(double));
        a.se[i] = calloc(n, sizeof(double));
    }
    return a;
}

int main(int argc, char **argv)
{
    struct refine_wish wish = refine_wish_none();
    const struct model *model = argc == 7 ? model_find(argv[2]) : NULL;
    if (model == NULL || refine_kind_parse(argv[3], &wish.kind) != STATUS_OK)
        return 2;
    wish.white = atof(argv[4]);
    size_t bands = (size_t)atoi(argv[5]), n = 0;
    struct recipe recipe = recipe_default(model);
    struct refine_many *many;
    struct fit fit;
    struct noise noise;
    enum noise_source source;
    float *all = read_all(argv[1], bands, &n);
    if (all == NULL || refine_wish_fit(&wish, &recipe, &fit, NULL) != STATUS_OK ||
        refine_wish_noise(&wish, NULL, 1, &noise, &source) != STATUS_OK ||
        refine_many_open(&fit, 400.0, 10.0, bands, &noise, &many, NULL) != STATUS_OK)
        return 1;
    struct refine_rows rows = { .R_float = all, .stride = bands, .n = n };
    struct refine_answers a = answers(&fit, n);
    double wall = seconds(CLOCK_MONOTONIC), cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
    if (refine_many_run(many, &rows, (unsigned)atoi(argv[6]), &a) != STATUS_OK)
        return 1;
    printf("%zu %.6f %.6f\n", n, seconds(CLOCK_MONOTONIC) - wall,
           seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu);
    return 0;
}
