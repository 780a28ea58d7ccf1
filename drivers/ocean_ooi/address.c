/* address.c - a list of options behind a link's address. */
#include "drivers/ocean_ooi/address.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"

#define PREFIX "ocean_ooi:"

static enum driver_result refuse(struct driver_error *error, const char *what, const char *why)
{
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "ocean_ooi: %.100s: %s", what, why);
}

static enum driver_result set_path(const char *key, const char *value, char path[OOI_PATH_SIZE],
                                   struct driver_error *error)
{
    if (path[0] != '\0')
        return refuse(error, key, "is given twice");
    if (value[0] == '\0' || strlen(value) >= OOI_PATH_SIZE)
        return refuse(error, key, "needs the path of a file, at most 1023 bytes");
    strcpy(path, value);
    return DRIVER_OK;
}

static enum driver_result set_option(struct ooi_address *a, const char *key, const char *value,
                                     struct driver_error *error)
{
    if (strcmp(key, "tile") == 0)
        return set_path("tile", value, a->tile, error);
    if (strcmp(key, "greys") == 0)
        return set_path("greys", value, a->greys, error);
    if (strcmp(key, "port_mm") == 0) {
        double mm;
        if (a->port_mm != 0.0)
            return refuse(error, key, "is given twice");
        if (number_parse(value, &mm) != STATUS_OK || !(mm >= 1.0 && mm <= 100.0))
            return refuse(error, "port_mm", "must be 1 to 100, the diameter in mm");
        a->port_mm = mm;
        return DRIVER_OK;
    }
    if (strcmp(key, "model") == 0) {
        if (a->model != NULL)
            return refuse(error, key, "is given twice");
        a->model = ooi_model_of_option(value);
        return a->model != NULL
                   ? DRIVER_OK
                   : refuse(error, "model", "must be usb2000+, usb4000, hr2000+ or hr4000");
    }
    return refuse(error, key, "no such option; there are tile, port_mm, greys and model");
}

/* What cannot be left out. */
static enum driver_result check(const struct ooi_address *a, struct driver_error *error)
{
    if (a->link[0] == '\0')
        return refuse(error, "address",
                      "begins with where it is: usb, usb:2457:101e or "
                      "usb:001:005, then ,tile=FILE,port_mm=N");
    if (a->tile[0] == '\0')
        return refuse(error, "tile",
                      "is missing: a reflectance needs the certified values of the white tile; "
                      "add ,tile=FILE with its SCE spectrum as CSV (id,specular,400,...,700)");
    if (a->port_mm == 0.0)
        return refuse(error, "port_mm",
                      "is missing: add ,port_mm=N with the diameter of the sphere's port in mm");
    return DRIVER_OK;
}

enum driver_result ooi_address_parse(const char *text, struct ooi_address *ret,
                                     struct driver_error *error)
{
    struct ooi_address a = { .model = NULL };
    char option[OOI_PATH_SIZE + 16];
    enum driver_result r = DRIVER_OK;
    if (strncmp(text, PREFIX, strlen(PREFIX)) == 0)
        text += strlen(PREFIX);
    size_t n = strcspn(text, ",");
    if (n >= sizeof a.link)
        return refuse(error, "address", "is too long");
    memcpy(a.link, text, n);
    for (text += n; r == DRIVER_OK && *text == ','; text += n) {
        n = strcspn(++text, ",");
        if (n >= sizeof option)
            return refuse(error, "an option", "is too long");
        memcpy(option, text, n);
        option[n] = '\0';
        char *equals = strchr(option, '=');
        if (equals == NULL)
            return refuse(error, option, "options are written key=value");
        *equals = '\0';
        r = set_option(&a, option, equals + 1, error);
    }
    if (r == DRIVER_OK)
        r = check(&a, error);
    if (r == DRIVER_OK)
        *ret = a;
    return r;
}
