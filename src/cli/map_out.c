/* map_out.c - a map in words: the key, the ENVI header, the report. */
#include "cli/map_out.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "base/version.h"

static const char *exact(double x, char text[NUMBER_TEXT_SIZE])
{
    return isnan(x) ? "none" : number_format_exact(x, text);
}

static void line(FILE *to, const char *name, double x)
{
    char text[NUMBER_TEXT_SIZE];
    fprintf(to, "%s: %s\n", name, exact(x, text));
}

/* ---- the key ------------------------------------------------------------------------ */

char *map_out_key(const struct map_report *r)
{
    const struct map_fit_options *o = r->options;
    const struct noise *noise = map_fit_noise(r->fit);
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (to == NULL)
        out_of_memory();
    fprintf(to, "program: skinspec %s\n", SKINSPEC_VERSION);
    fprintf(to, "cube header: sha256 %s\n", r->cube->header_hash);
    fprintf(to, "cube data: %" PRIu64 " bytes, changed at %" PRId64 ".%09ld\n",
            (uint64_t)r->cube->data_stat.st_size, (int64_t)r->cube->data_stat.st_mtim.tv_sec,
            r->cube->data_stat.st_mtim.tv_nsec);
    fprintf(to, "model: %s\nrefine: %s\n", o->model->name, refine_kind_name(o->wish.kind));
    line(to, "first nm", r->grid->first_nm);
    line(to, "step nm", r->grid->step_nm);
    fprintf(to, "bands: %zu of %zu used\n", r->grid->n, r->grid->used);
    line(to, "noise white", noise->white);
    line(to, "noise placement", noise->placement);
    fprintf(to, "noise stated: %s\n",
            isnan(o->wish.white) && isnan(o->wish.placement) ? "no" : "yes");
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        line(to, skin_parameter_name(i), o->wish.fix[i]);
    line(to, "epidermis mm", o->epidermis_mm);
    line(to, "scale", o->scale);
    line(to, "surface", o->surface);
    fprintf(to, "ends of intervals: %s\n", o->intervals ? "yes" : "no");
    if (fclose(to) != 0)
        out_of_memory();
    return text;
}

/* ---- the header --------------------------------------------------------------------- */

/* What it is made of, for whoever reads it, and for --resume. */
static void print_key(const char *key, FILE *to)
{
    while (*key != '\0') {
        size_t n = strcspn(key, "\n");
        fprintf(to, MAP_FILE_KEY_LINE "%.*s\n", (int)n, key);
        key += n + (key[n] == '\n');
    }
}

static void print_header(const struct map_report *r, FILE *to)
{
    static const uint16_t one = 1;
    const struct map_file *f = r->file;
    fputs("ENVI\n", to);
    print_key(f->key, to);
    fprintf(to, "description = {skin by skinspec %s, model %s; flags are a set of bits:",
            SKINSPEC_VERSION, r->options->model->name);
    for (size_t i = 0; i < MAP_FLAG_COUNT; i++)
        fprintf(to, "%s\n %lu %s", i > 0 ? "," : "", 1ul << i, map_flag_name(i));
    fprintf(to, "}\nsamples = %zu\nlines = %zu\nbands = %zu\nheader offset = 0\n", f->samples,
            f->lines, f->bands);
    fprintf(to, "file type = ENVI Standard\ndata type = 4\ninterleave = bsq\nbyte order = %d\n",
            *(const unsigned char *)&one == 1 ? 0 : 1);
    fprintf(to, "data ignore value = nan\nband names = {\n");
    for (size_t i = 0; i < f->bands; i++)
        fprintf(to, " %s%s", map_fit_band_name(r->fit, i), i + 1 < f->bands ? ",\n" : "}\n");
}

enum status map_out_finish(const struct map_report *r, struct map_file *file)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (to == NULL)
        out_of_memory();
    print_header(r, to);
    if (fclose(to) != 0)
        out_of_memory();
    enum status s = map_file_finish(file, text);
    free(text);
    return s;
}

/* ---- the report --------------------------------------------------------------------- */

static void print_report(const struct map_report *r)
{
    const struct map_contents *c = r->contents;
    char a[NUMBER_TEXT_SIZE], b[NUMBER_TEXT_SIZE];
    printf("%s: %zu by %zu pixels, %zu of %zu bands as %zu from %s nm by %s\n", r->cube->path,
           r->file->samples, r->file->lines, r->grid->used, r->cube->header.bands, r->grid->n,
           number_format(r->grid->first_nm, 6, a), number_format(r->grid->step_nm, 6, b));
    printf("fitted %" PRIu64 " of %" PRIu64 " pixels by %s, refine %s, in %.2f s\n", c->fitted,
           c->pixels, r->options->model->name, refine_kind_name(r->options->wish.kind), r->seconds);
    for (size_t i = 0; i < MAP_FLAG_COUNT; i++)
        if (c->flagged[i] > 0)
            printf("  %-22s %" PRIu64 "\n", map_flag_name(i), c->flagged[i]);
    printf("  %-14s %10s %10s %10s\n", "", "1 %", "median", "99 %");
    for (size_t i = 0; i + 1 < r->file->bands; i++)
        printf("  %-14s %10.4g %10.4g %10.4g\n", map_fit_band_name(r->fit, i), c->band[i].lo,
               c->band[i].median, c->band[i].hi);
    printf("%s, %s", r->file->image, r->file->header);
    if (r->pictures)
        printf(", %s-%s.png ... -%s.png", r->file->prefix, map_fit_band_name(r->fit, 0),
               map_fit_band_name(r->fit, r->file->bands - 2));
    putchar('\n');
}

static cJSON *bands_json(const struct map_report *r)
{
    cJSON *all = cJSON_CreateArray();
    char path[MAP_PICTURES_PATH_SIZE];
    for (size_t i = 0; i + 1 < r->file->bands; i++) {
        const struct map_band *band = &r->contents->band[i];
        cJSON *object = cJSON_CreateObject();
        cJSON_AddStringToObject(object, "name", map_fit_band_name(r->fit, i));
        out_member(object, "p01", band->lo);
        out_member(object, "median", band->median);
        out_member(object, "p99", band->hi);
        if (r->pictures) {
            map_pictures_path(r->file->prefix, r->fit, i, path);
            cJSON_AddStringToObject(object, "picture", path);
            cJSON_AddItemToObject(object, "range", out_numbers(band->range, 2));
        }
        cJSON_AddItemToArray(all, object);
    }
    return all;
}

static cJSON *to_json(const struct map_report *r)
{
    const struct map_contents *c = r->contents;
    const struct noise *n = map_fit_noise(r->fit);
    cJSON *object = cJSON_CreateObject(), *flags = cJSON_CreateObject();
    cJSON *grid = cJSON_CreateObject(), *noise = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "cube", r->cube->path);
    out_member(object, "samples", (double)r->file->samples);
    out_member(object, "lines", (double)r->file->lines);
    cJSON_AddStringToObject(object, "model", r->options->model->name);
    cJSON_AddStringToObject(object, "refine", refine_kind_name(r->options->wish.kind));
    out_member(grid, "used", (double)r->grid->used);
    cJSON_AddBoolToObject(grid, "as_is", r->grid->as_is);
    out_member(grid, "first_nm", r->grid->first_nm);
    out_member(grid, "step_nm", r->grid->step_nm);
    out_member(grid, "n", (double)r->grid->n);
    cJSON_AddItemToObject(object, "bands", grid);
    out_member(noise, "white", n->white);
    out_member(noise, "placement", n->placement);
    cJSON_AddItemToObject(object, "noise", noise);
    out_member(object, "pixels", (double)c->pixels);
    out_member(object, "fitted", (double)c->fitted);
    for (size_t i = 0; i < MAP_FLAG_COUNT; i++)
        out_member(flags, map_flag_name(i), (double)c->flagged[i]);
    cJSON_AddItemToObject(object, "flags", flags);
    cJSON_AddItemToObject(object, "maps", bands_json(r));
    cJSON_AddStringToObject(object, "image", r->file->image);
    cJSON_AddStringToObject(object, "header", r->file->header);
    out_member(object, "seconds", r->seconds);
    out_member(object, "lines_done", (double)r->lines);
    return object;
}

void map_out_report(const struct map_report *r, enum out_format format)
{
    if (format == OUT_PLAIN)
        print_report(r);
    else
        out_one(to_json(r));
}
