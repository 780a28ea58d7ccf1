/* trial_out.c - the columns of trial/csv.h as members. */
#include "cli/trial_out.h"

#include "cli/out.h"
#include "trial/csv.h"

static const char *const parameters[3] = { "Cm", "Bm", "Ch" };

/* A new object at the end of an array. */
static cJSON *object_in(cJSON *array)
{
    cJSON *object = cJSON_CreateObject();
    if (object == NULL || !cJSON_AddItemToArray(array, object))
        out_of_memory();
    return object;
}

static cJSON *array_of(cJSON *object, const char *name)
{
    cJSON *array = cJSON_AddArrayToObject(object, name);
    if (array == NULL)
        out_of_memory();
    return array;
}

static void text(cJSON *object, const char *name, const char *value)
{
    if (cJSON_AddStringToObject(object, name, value) == NULL)
        out_of_memory();
}

static void truth(cJSON *object, const char *name, bool value)
{
    if (cJSON_AddBoolToObject(object, name, value) == NULL)
        out_of_memory();
}

static void errors(cJSON *object, const char *set, const struct trial_errors *e)
{
    cJSON *o = cJSON_AddObjectToObject(object, set);
    if (o == NULL)
        out_of_memory();
    for (size_t k = 0; k < 3; k++)
        out_member(o, parameters[k], e->rmse[k]);
    out_member(o, "dE00", e->dE00);
    out_member(o, "rms_R", e->rms_R);
    out_member(o, "times", e->times);
    truth(o, "front", e->front);
}

static void inversion(cJSON *array, const struct trial_result *r)
{
    const struct trial_method *m = &r->method;
    cJSON *o = object_in(array);
    char name[TRIAL_NAME_SIZE];
    text(o, "name", trial_method_name(m, name));
    text(o, "model", m->model->name);
    out_member(o, "rows", (double)m->rows);
    if (m->rows > 0)
        text(o, "by", match_by_name(m->by));
    text(o, "answer", trial_kind_name(m));
    truth(o, "interval", m->interval);
    truth(o, "batch", m->batch);
    text(o, "kernel", m->kernel == TRIAL_PLAIN ? "plain" : "quick");
    out_member(o, "us", r->us);
    out_member(o, "us_p95", r->us_p95);
    out_member(o, "timed", (double)r->timed);
    errors(o, "own", &r->own);
    errors(o, "transport", &r->transport);
    out_member(o, "bytes", r->bytes);
}

static void forward(cJSON *array, const struct trial_forward *f)
{
    cJSON *o = object_in(array);
    char name[TRIAL_FORWARD_NAME_SIZE];
    text(o, "name", trial_forward_name(f, name));
    text(o, "model", f->model->name);
    out_member(o, "us", f->us);
    out_member(o, "us_p95", f->us_p95);
    out_member(o, "timed", (double)f->timed);
    out_member(o, "rms_R", f->rms_R);
    out_member(o, "worst_R", f->worst_R);
    out_member(o, "dE00", f->dE00);
    truth(o, "front", f->front);
}

void trial_out_json(const struct trial *trial, const char *machine)
{
    cJSON *o = cJSON_CreateObject();
    if (o == NULL)
        out_of_memory();
    text(o, "machine", machine);
    out_member(o, "skins", (double)trial->skins);
    out_member(o, "seed", (double)trial->seed);
    out_member(o, "rounds", (double)trial->rounds);
    out_member(o, "noise", TRIAL_NOISE);
    cJSON *array = array_of(o, "inversion");
    for (size_t i = 0; i < trial->results; i++)
        inversion(array, &trial->result[i]);
    array = array_of(o, "bounds");
    for (size_t i = 0; i < trial->bounds; i++) {
        cJSON *bound = object_in(array);
        text(bound, "model", trial->bound[i].model->name);
        for (size_t k = 0; k < 3; k++)
            out_member(bound, parameters[k], trial->bound[i].sd[k]);
    }
    array = array_of(o, "forward");
    for (size_t i = 0; i < trial->forwards; i++)
        forward(array, &trial->forward[i]);
    out_one(o);
}
