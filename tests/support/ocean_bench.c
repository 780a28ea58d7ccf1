/* ocean_bench.c - a link in front of another. */
#include "tests/support/ocean_bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SPECTRA = 0x82, SPECTRA_EARLY = 0x86 };

struct spoiled {
    struct link link;
    struct link *inner;
    struct ocean_bench *bench;
    bool silent;
};

static enum driver_result spoiled_send(struct link *link, uint8_t channel, const void *bytes,
                                       size_t n, int64_t deadline_ms, struct driver_error *error)
{
    struct spoiled *s = (struct spoiled *)link;
    return link_send(s->inner, channel, bytes, n, deadline_ms, error);
}

static enum driver_result spoiled_receive(struct link *link, uint8_t channel, void *bytes,
                                          size_t size, size_t *n, int64_t deadline_ms,
                                          struct driver_error *error)
{
    struct spoiled *s = (struct spoiled *)link;
    struct ocean_bench *b = s->bench;
    if (s->silent && (channel == SPECTRA || channel == SPECTRA_EARLY))
        return call_wait(link->call, -1, deadline_ms) == CALL_CANCELLED
                   ? driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled")
                   : driver_fail(error, DRIVER_TIMEOUT, NULL, "nothing came");
    enum driver_result r = link_receive(s->inner, channel, bytes, size, n, deadline_ms, error);
    if (r != DRIVER_OK || channel != b->channel)
        return r;
    b->transfers++;
    if ((b->transfers == b->transfer || (b->every && b->transfers > b->transfer)) && b->byte < *n) {
        ((uint8_t *)bytes)[b->byte] ^= b->mask;
        b->spoiled = true;
    }
    return r;
}

static enum driver_result spoiled_drain(struct link *link, uint8_t channel, int quiet_ms,
                                        int64_t deadline_ms, struct driver_error *error)
{
    struct spoiled *s = (struct spoiled *)link;
    return link_drain(s->inner, channel, quiet_ms, deadline_ms, error);
}

static void place(struct ocean_bench *bench, const char *call)
{
    static const char *const needs[][2] = { { "calibrate zero", "place black" },
                                            { "calibrate white", "place white" },
                                            { "measure", "place skin" } };
    for (size_t i = 0; bench->hands && i < 3; i++)
        if (strcmp(call, needs[i][0]) == 0)
            (void)wire_memory_act(bench->memory, needs[i][1]);
}

static void spoiled_begin(struct link *link, const char *call)
{
    struct spoiled *s = (struct spoiled *)link;
    place(s->bench, call);
    if (strcmp(call, "measure") == 0)
        s->bench->measures++;
    s->silent = s->bench->silent_measure > 0 && s->bench->measures == s->bench->silent_measure &&
                strcmp(call, "measure") == 0;
    if (s->inner->ops->begin != NULL)
        s->inner->ops->begin(s->inner, call);
}

static void spoiled_close(struct link *link)
{
    struct spoiled *s = (struct spoiled *)link;
    link_close(s->inner);
    free(s);
}

static const struct link_ops spoiled_ops = {
    .kind = "spoiled",
    .send = spoiled_send,
    .receive = spoiled_receive,
    .drain = spoiled_drain,
    .begin = spoiled_begin,
    .close = spoiled_close,
};

static enum driver_result spoiled_open(const struct link_source *source,
                                       const struct link_wanted *wanted, struct link **ret,
                                       struct driver_error *error)
{
    struct ocean_bench *bench = (struct ocean_bench *)(uintptr_t)source;
    const struct link_source *memory = wire_memory_source(bench->memory);
    struct spoiled *s = calloc(1, sizeof *s);
    if (s == NULL)
        abort();
    enum driver_result r = memory->open(memory, wanted, &s->inner, error);
    if (r != DRIVER_OK) {
        free(s);
        return r;
    }
    s->link.ops = &spoiled_ops;
    s->link.call = wanted->call;
    s->bench = bench;
    if (wanted->usb->pid != NULL && bench->pid != 0)
        *wanted->usb->pid = bench->pid;
    *ret = &s->link;
    return DRIVER_OK;
}

void ocean_bench_make(struct ocean_bench *bench, const struct sim_kind *kind, const char *options)
{
    ocean_bench_free(bench);
    memset(bench, 0, sizeof *bench);
    bench->source.open = spoiled_open;
    bench->memory = wire_memory_make(kind, options);
    bench->pid = kind->pid;
    if (bench->memory == NULL)
        abort();
}

void ocean_bench_free(struct ocean_bench *bench)
{
    wire_memory_free(bench->memory);
    bench->memory = NULL;
}

void ocean_bench_spoil(struct ocean_bench *bench, uint8_t channel, unsigned transfer, size_t byte,
                       uint8_t mask)
{
    bench->channel = channel;
    bench->transfer = transfer;
    bench->byte = byte;
    bench->mask = mask;
    bench->transfers = 0;
    bench->every = bench->spoiled = false;
}

/* ---- files -------------------------------------------------------------------------- */

static char folder[] = "/tmp/ocean-bench-XXXXXX";
static bool has_folder;

const char *ocean_bench_path(const char *name)
{
    static char path[2][256];
    static unsigned turn;
    char *p = path[turn++ % 2];
    if (!has_folder && mkdtemp(folder) == NULL)
        abort();
    has_folder = true;
    snprintf(p, sizeof path[0], "%s/%s", folder, name);
    return p;
}

/* The simulator's white, as its description has it: 0.975 less a bell of 0.05 at 360 nm. */
static void write_tile(const char *path)
{
    FILE *f = fopen(path, "we");
    if (f == NULL)
        abort();
    fprintf(f, "id,specular");
    for (int nm = 380; nm <= 720; nm += 5)
        fprintf(f, ",%d", nm);
    fprintf(f, "\nSIM-WHITE,sce");
    for (int nm = 380; nm <= 720; nm += 5)
        fprintf(f, ",%.9f", 0.975 - 0.05 * exp(-0.5 * pow((nm - 360) / 40.0, 2.0)));
    fprintf(f, "\n");
    fclose(f);
}

const char *ocean_bench_address(void)
{
    static char address[512];
    const char *path = ocean_bench_path("tile.csv");
    write_tile(path);
    snprintf(address, sizeof address, "usb,tile=%s,port_mm=8", path);
    return address;
}

void ocean_bench_clean(void)
{
    char command[64];
    if (!has_folder)
        return;
    snprintf(command, sizeof command, "rm -rf %s", folder);
    if (system(command) != 0)
        fprintf(stderr, "ocean_bench: %s stays\n", folder);
    has_folder = false;
    strcpy(folder + strlen(folder) - 6, "XXXXXX");
}
