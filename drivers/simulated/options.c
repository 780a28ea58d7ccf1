/* options.c - one table of options; each row knows its place and what it accepts. */
#include "drivers/simulated/options.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"

static const struct options defaults = {
    .serial = "SIM-1",
    .model = "two-layer",
    .Cm = 0.03,
    .Bm = 0.7,
    .Ch = 0.01,
    .epidermis_mm = 0.08,
    .replicates = 1.0,
    .surface = 0.04,
    .seed = 1.0,
    .noise = 0.0005,
    .placement = 0.02,
    .unit = 0.004,
    .speed = 1.0,
    .shot_ms = 600.0,
    .charge_ms = 1000.0,
    .calibrate_ms = 2000.0,
    .slow_ms = 1500.0,
    .calibration_shots = 1000.0,
    .calibration_minutes = 480.0,
    .battery = 100.0,
    .drain = 0.05,
    .temperature_C = 24.0,
};

enum kind { KIND_NUMBER, KIND_WHOLE, KIND_TEXT, KIND_MODEL, KIND_SPEED, KIND_OVERDUE, KIND_FAULT };

static const struct option {
    const char *key;
    enum kind kind;
    size_t at;       /* of the member in struct options */
    double min, max; /* text: max is the size of the member */
} table[] = {
#define AT(member) offsetof(struct options, member)
#define TEXT(member) AT(member), 0, sizeof((struct options *)NULL)->member
    { "serial", KIND_TEXT, TEXT(serial) },
    { "model", KIND_MODEL, TEXT(model) },
    { "cm", KIND_NUMBER, AT(Cm), 0, 1 },
    { "bm", KIND_NUMBER, AT(Bm), 0, 1 },
    { "ch", KIND_NUMBER, AT(Ch), 0, 1 },
    { "epidermis_mm", KIND_NUMBER, AT(epidermis_mm), 0, 10 },
    { "spectra", KIND_TEXT, TEXT(spectra) },
    { "replicates", KIND_WHOLE, AT(replicates), 1, 1000 },
    { "pressure", KIND_NUMBER, AT(pressure), 0, 1 },
    { "surface", KIND_NUMBER, AT(surface), 0, 0.1 },
    { "seed", KIND_WHOLE, AT(seed), 0, 9007199254740992.0 },
    { "noise", KIND_NUMBER, AT(noise), 0, 0.1 },
    { "placement", KIND_NUMBER, AT(placement), 0, 0.2 },
    { "unit", KIND_NUMBER, AT(unit), 0, 0.1 },
    { "drift", KIND_NUMBER, AT(drift), -0.1, 0.1 },
    { "speed", KIND_SPEED, AT(speed), 0.1, 1000 },
    { "shot_ms", KIND_NUMBER, AT(shot_ms), 0, 60000 },
    { "charge_ms", KIND_NUMBER, AT(charge_ms), 0, 60000 },
    { "calibrate_ms", KIND_NUMBER, AT(calibrate_ms), 0, 60000 },
    { "slow_ms", KIND_NUMBER, AT(slow_ms), 0, 600000 },
    { "calibration_shots", KIND_WHOLE, AT(calibration_shots), 1, 1000000 },
    { "calibration_minutes", KIND_NUMBER, AT(calibration_minutes), 0, 100000 },
    { "overdue", KIND_OVERDUE, AT(warns_when_overdue), 0, 0 },
    { "battery", KIND_NUMBER, AT(battery), 0, 100 },
    { "drain", KIND_NUMBER, AT(drain), 0, 100 },
    { "temperature", KIND_NUMBER, AT(temperature_C), -40, 80 },
    { "stored", KIND_WHOLE, AT(stored), 0, 9999 },
    { "button_ms", KIND_NUMBER, AT(button_ms), 0, 3600000 },
    { "button_file", KIND_TEXT, TEXT(button_file) },
    { "fault", KIND_FAULT, AT(fault), 0, 0 },
};
enum { OPTIONS = sizeof table / sizeof *table };

static const char *const operation_names[OPERATIONS] = {
    "open",    "configure",   "status",       "calibrate",
    "measure", "wait_button", "stored_count", "stored_read",
};

/* Which faults there are, and at which operations (a bit each). */
#define ANY ((1u << OPERATIONS) - 1)
#define OPEN (1u << OPERATION_OPEN)
#define CALIBRATE (1u << OPERATION_CALIBRATE)
#define MEASURE (1u << OPERATION_MEASURE)
#define STORED_READ (1u << OPERATION_STORED_READ)
static const struct fault_row {
    const char *name;
    unsigned at;
} fault_rows[FAULTS] = {
    [FAULT_NONE] = { "", 0 },
    [FAULT_SILENCE] = { "silence", ANY },
    [FAULT_SLOW] = { "slow", ANY },
    [FAULT_GONE] = { "gone", ANY },
    [FAULT_GARBAGE] = { "garbage", ANY },
    [FAULT_BUSY] = { "busy", OPEN },
    [FAULT_NO_PERMISSION] = { "no_permission", OPEN },
    [FAULT_SWAPPED] = { "swapped", CALIBRATE },
    [FAULT_LAMP] = { "lamp", CALIBRATE | MEASURE },
    [FAULT_BATTERY] = { "battery", CALIBRATE | MEASURE },
    [FAULT_CHARGE] = { "charge", MEASURE },
    [FAULT_WEAK_LAMP] = { "weak_lamp", MEASURE },
    [FAULT_EXPIRED] = { "expired", MEASURE },
    [FAULT_WRONG_BANDS] = { "wrong_bands", MEASURE | STORED_READ },
    [FAULT_NAN] = { "nan", MEASURE | STORED_READ },
    [FAULT_ALL_ZERO] = { "all_zero", MEASURE | STORED_READ },
};

/* ---- refusals ------------------------------------------------------------------- */

/* One option as it was written, "key=value". */
struct item {
    char key[32];
    char value[OPTIONS_PATH_SIZE];
};

static enum driver_result refuse(struct driver_error *error, const struct item *item,
                                 const char *allowed)
{
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "simulated: %s=%.32s: allowed is %s",
                       item->key, item->value, allowed);
}

/* Adds a name to a list "a, b, c". */
static void list_add(char list[DRIVER_TEXT_SIZE], const char *name)
{
    size_t used = strlen(list);
    snprintf(list + used, DRIVER_TEXT_SIZE - used, "%s%s", used > 0 ? ", " : "", name);
}

static enum driver_result refuse_key(struct driver_error *error, const char *key)
{
    char list[DRIVER_TEXT_SIZE] = "";
    for (size_t i = 0; i < OPTIONS; i++)
        list_add(list, table[i].key);
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                       "simulated: no option '%.31s'; there are %s", key, list);
}

/* ---- values ----------------------------------------------------------------------- */

static enum driver_result set_number(const struct option *option, const struct item *item,
                                     double *place, struct driver_error *error)
{
    double x;
    bool whole = option->kind == KIND_WHOLE;
    if (number_parse(item->value, &x) != STATUS_OK || !(x >= option->min && x <= option->max) ||
        (whole && x != floor(x))) {
        char allowed[128];
        snprintf(allowed, sizeof allowed, "%s from %.16g to %.16g%s",
                 whole ? "a whole number" : "a number", option->min, option->max,
                 option->kind == KIND_SPEED ? ", or \"instant\"" : "");
        return refuse(error, item, allowed);
    }
    *place = x;
    return DRIVER_OK;
}

static enum driver_result set_text(const struct option *option, const struct item *item,
                                   char *place, struct driver_error *error)
{
    size_t size = (size_t)option->max;
    if (strlen(item->value) >= size) {
        char allowed[64];
        snprintf(allowed, sizeof allowed, "a text of at most %zu characters", size - 1);
        return refuse(error, item, allowed);
    }
    snprintf(place, size, "%s", item->value);
    return DRIVER_OK;
}

static bool is_one_of(const char *text, const char *a, const char *b)
{
    return strcmp(text, a) == 0 || strcmp(text, b) == 0;
}

/* Whose names a fault is made of. */
static enum operation find_operation(const char *name)
{
    enum operation o = OPERATION_OPEN;
    while (o < OPERATIONS && strcmp(operation_names[o], name) != 0)
        o++;
    return o;
}

static enum fault find_fault(const char *name, enum operation operation)
{
    enum fault f = FAULT_SILENCE;
    while (f < FAULTS &&
           !(strcmp(fault_rows[f].name, name) == 0 && (fault_rows[f].at & 1u << operation) != 0))
        f++;
    return f;
}

static enum driver_result refuse_operation(struct driver_error *error, const struct item *item)
{
    char allowed[DRIVER_TEXT_SIZE] = "";
    for (size_t i = 0; i < OPERATIONS; i++)
        list_add(allowed, operation_names[i]);
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                       "simulated: fault=%.32s: allowed is OPERATION:N:KIND (N from 1, \"3+\" for "
                       "the third and later); operations are %s",
                       item->value, allowed);
}

static enum driver_result refuse_kind(struct driver_error *error, const struct item *item,
                                      enum operation operation)
{
    char allowed[DRIVER_TEXT_SIZE] = "";
    for (enum fault f = FAULT_SILENCE; f < FAULTS; f++)
        if ((fault_rows[f].at & 1u << operation) != 0)
            list_add(allowed, fault_rows[f].name);
    return refuse(error, item, allowed);
}

/* "measure:3:silence" */
static enum driver_result set_fault(const struct item *item, struct options *ret,
                                    struct driver_error *error)
{
    char operation[16], nth[16], kind[16];
    struct planned_fault planned;
    int used = 0;
    if (sscanf(item->value, "%15[a-z_]:%15[0-9+]:%15[a-z_]%n", operation, nth, kind, &used) != 3 ||
        item->value[used] != '\0')
        return refuse_operation(error, item);

    size_t digits = strcspn(nth, "+");
    planned.and_later = strcmp(nth + digits, "+") == 0;
    if (planned.and_later)
        nth[digits] = '\0';
    planned.operation = find_operation(operation);
    if (planned.operation == OPERATIONS ||
        number_parse_count(nth, 1000000, &planned.call) != STATUS_OK || planned.call == 0)
        return refuse_operation(error, item);
    planned.fault = find_fault(kind, planned.operation);
    if (planned.fault == FAULTS)
        return refuse_kind(error, item, planned.operation);
    if (ret->faults == OPTIONS_MAX_FAULTS)
        return refuse(error, item, "at most 8 of them");
    ret->fault[ret->faults++] = planned;
    return DRIVER_OK;
}

static enum driver_result set_value(const struct option *option, const struct item *item,
                                    struct options *ret, struct driver_error *error)
{
    void *place = (char *)ret + option->at;
    switch (option->kind) {
    case KIND_FAULT:
        return set_fault(item, ret, error);
    case KIND_MODEL: /* the paper's own gives no spectra */
        if (!is_one_of(item->value, "two-layer", "half-space"))
            return refuse(error, item, "two-layer or half-space");
        return set_text(option, item, place, error);
    case KIND_TEXT:
        return set_text(option, item, place, error);
    case KIND_OVERDUE:
        if (!is_one_of(item->value, "refuse", "warn"))
            return refuse(error, item, "refuse or warn");
        ret->warns_when_overdue = strcmp(item->value, "warn") == 0;
        return DRIVER_OK;
    case KIND_SPEED:
        if (strcmp(item->value, "instant") == 0) {
            ret->speed = INFINITY;
            return DRIVER_OK;
        }
        return set_number(option, item, place, error);
    case KIND_NUMBER:
    case KIND_WHOLE:
        break;
    }
    return set_number(option, item, place, error);
}

/* ---- the whole --------------------------------------------------------------------- */

static const struct option *find_option(const char *key)
{
    for (size_t i = 0; i < OPTIONS; i++)
        if (strcmp(table[i].key, key) == 0)
            return &table[i];
    return NULL;
}

/* The item at *at, up to a comma; *at moves behind it. */
static enum driver_result next_item(const char **at, struct item *ret, struct driver_error *error)
{
    size_t size = strcspn(*at, ",");
    const char *equals = memchr(*at, '=', size);
    size_t key = equals != NULL ? (size_t)(equals - *at) : size;
    size_t value = equals != NULL ? size - key - 1 : 0;
    for (size_t i = 0; i < size; i++)
        if ((*at)[i] < ' ' || (*at)[i] > '~')
            return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                               "simulated: options are printable ASCII: key=value,key=value");
    snprintf(ret->key, sizeof ret->key, "%.*s", (int)(key < sizeof ret->key ? key : 0), *at);
    if (equals == NULL || ret->key[0] == '\0')
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "simulated: '%.*s' is no option: write key=value,key=value",
                           (int)(size < 32 ? size : 32), *at);
    if (value >= sizeof ret->value)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "simulated: %s: allowed are %zu characters", ret->key,
                           sizeof ret->value - 1);
    snprintf(ret->value, sizeof ret->value, "%.*s", (int)value, equals + 1);
    *at += size;
    if (**at == ',')
        (*at)++;
    return DRIVER_OK;
}

/* "simulated:" before the options says nothing new. */
static const char *without_name(const char *address)
{
    static const char name[] = "simulated";
    if (address == NULL)
        return "";
    if (strncmp(address, name, strlen(name)) != 0)
        return address;
    const char *rest = address + strlen(name);
    return *rest == ':' ? rest + 1 : *rest == '\0' ? rest : address;
}

/* What no option alone can say. */
static enum driver_result check_together(const struct options *o, struct driver_error *error)
{
    if (o->pressure > 0.0 && o->replicates < 2.0)
        return driver_fail(
            error, DRIVER_UNSUPPORTED, NULL,
            "simulated: pressure grows over replicates: set replicates to 2 or more");
    if (o->pressure > 0.0 && o->spectra[0] != '\0')
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "simulated: pressure acts on a computed skin, not on spectra");
    return DRIVER_OK;
}

enum driver_result options_parse(const char *address, struct options *ret,
                                 struct driver_error *error)
{
    struct options o = defaults;
    bool seen[OPTIONS] = { false };
    for (const char *at = without_name(address); *at != '\0';) {
        struct item item;
        enum driver_result r = next_item(&at, &item, error);
        if (r != DRIVER_OK)
            return r;
        const struct option *option = find_option(item.key);
        if (option == NULL)
            return refuse_key(error, item.key);
        if (seen[option - table] && option->kind != KIND_FAULT)
            return refuse(error, &item, "once");
        seen[option - table] = true;
        r = set_value(option, &item, &o, error);
        if (r != DRIVER_OK)
            return r;
    }
    enum driver_result r = check_together(&o, error);
    if (r == DRIVER_OK)
        *ret = o;
    return r;
}

enum fault options_fault(const struct options *options, enum operation operation, size_t call)
{
    for (size_t i = 0; i < options->faults; i++) {
        const struct planned_fault *f = &options->fault[i];
        if (f->operation == operation && (f->call == call || (f->and_later && call > f->call)))
            return f->fault;
    }
    return FAULT_NONE;
}
