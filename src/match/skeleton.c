/* skeleton.c - pivots, and the weights by back substitution. */
#include "match/skeleton.h"

#include <stdlib.h>
#include <string.h>

/* One step for all values: what they have of the direction q is taken off. */
struct step {
    size_t stride, samples;
    const double *restrict q; /* [samples], of length 1 */
    double *restrict F;       /* [samples][stride] */
    double *restrict part;    /* [stride] how much of q they had */
    double *restrict rest;    /* [stride] squared length of what is left */
};

VECTORS_INLINE void take_off(const struct step *s, bool fused)
{
    for (size_t at = 0; at < s->stride; at += VECTORS_LANES) {
        double part[VECTORS_LANES] = { 0.0 }, rest[VECTORS_LANES] = { 0.0 };
        const double *restrict q = s->q;
        for (size_t k = 0; k < s->samples; k++) {
            const double *restrict f = s->F + k * s->stride + at;
            VECTORS_LOOP
            for (int l = 0; l < VECTORS_LANES; l++)
                part[l] = vectors_sum(fused, f[l], q[k], part[l]);
        }
        for (size_t k = 0; k < s->samples; k++) {
            double *restrict f = s->F + k * s->stride + at;
            VECTORS_LOOP
            for (int l = 0; l < VECTORS_LANES; l++) {
                double left = vectors_sum(fused, -part[l], q[k], f[l]);
                f[l] = left;
                rest[l] = vectors_sum(fused, left, left, rest[l]);
            }
        }
        memcpy(s->part + at, part, sizeof part);
        memcpy(s->rest + at, rest, sizeof rest);
    }
}

static void take_off_plain(const struct step *s)
{
    take_off(s, false);
}

VECTORS_AVX2 static void take_off_avx2(const struct step *s)
{
    take_off(s, true);
}

VECTORS_AVX512 static void take_off_avx512(const struct step *s)
{
    take_off(s, true);
}

static void take(const struct step *s, enum vectors vectors)
{
    if (vectors == VECTORS_WITH_AVX512)
        take_off_avx512(s);
    else if (vectors == VECTORS_WITH_AVX2)
        take_off_avx2(s);
    else
        take_off_plain(s);
}

static size_t longest(size_t n, const double *rest)
{
    size_t best = 0;
    for (size_t i = 1; i < n; i++)
        if (rest[i] > rest[best])
            best = i;
    return best;
}

/* Nodes until no more than `missing` is left; part[m * stride + i] is what value i has of the
 * direction that node m added. */
static enum status find_nodes(const struct step *first, double missing, enum vectors vectors,
                              struct skeleton *ret, double *q, double *part)
{
    struct step s = *first;
    memset(q, 0, s.samples * sizeof *q);
    s.part = part;
    take(&s, vectors); /* of nothing: for the lengths */
    double enough = s.rest[longest(ret->n, s.rest)] * missing * missing;
    for (;;) {
        size_t node = longest(ret->n, s.rest);
        if (s.rest[node] <= enough)
            return STATUS_OK;
        if (ret->nodes == SKELETON_MAX)
            return STATUS_UNSUPPORTED;
        double scale = 1.0 / sqrt(s.rest[node]);
        for (size_t k = 0; k < s.samples; k++)
            q[k] = s.F[k * s.stride + node] * scale;
        s.part = part + ret->nodes * s.stride;
        take(&s, vectors);
        ret->node[ret->nodes++] = node;
    }
}

/* Node m has of its own direction and of those before, so weights follow from the last on. */
static void find_weights(const double *part, size_t stride, struct skeleton *ret)
{
    for (size_t i = 0; i < ret->n; i++) {
        double *w = ret->weight + i * SKELETON_MAX;
        for (size_t j = ret->nodes; j-- > 0;) {
            double sum = part[j * stride + i];
            for (size_t m = j + 1; m < ret->nodes; m++)
                sum -= w[m] * part[j * stride + ret->node[m]];
            w[j] = sum / part[j * stride + ret->node[j]];
        }
    }
    for (size_t m = 0; m < ret->nodes; m++) {
        double *w = ret->weight + ret->node[m] * SKELETON_MAX;
        memset(w, 0, SKELETON_MAX * sizeof *w);
        w[m] = 1.0;
    }
}

enum status skeleton_init(size_t n, size_t samples, double *F, double missing, enum vectors vectors,
                          struct skeleton *ret)
{
    size_t stride = SKELETON_STRIDE(n);
    double *part = calloc((SKELETON_MAX + 1) * stride + samples, sizeof *part);
    *ret = (struct skeleton){ .n = n, .weight = calloc(n * SKELETON_MAX, sizeof(double)) };
    enum status status = STATUS_NO_MEMORY;
    if (part != NULL && ret->weight != NULL) {
        double *rest = part + SKELETON_MAX * stride, *q = rest + stride;
        struct step first = { .stride = stride, .samples = samples, .q = q, .F = F, .rest = rest };
        status = find_nodes(&first, missing, vectors, ret, q, part);
    }
    if (status == STATUS_OK)
        find_weights(part, stride, ret);
    else
        skeleton_done(ret);
    free(part);
    return status;
}

void skeleton_done(struct skeleton *s)
{
    free(s->weight);
    *s = (struct skeleton){ 0 };
}
