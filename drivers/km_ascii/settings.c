/* settings.c - measuring area, averages, delay, and whose plate the white step is made with. */
#include <stdio.h>
#include <string.h>

#include "drivers/km_ascii/conversation.h"

static const double area_mm[2] = { 8.0, 3.0 }; /* as in dialect->area */
static const char *const area_name[2] = { "MAV (8 mm)", "SAV (3 mm)" };

static size_t index_of_area(const struct instrument *in, unsigned area)
{
    return area == in->dialect->area[0] ? 0 : 1;
}

void km_take_areas(struct instrument *in, unsigned area)
{
    size_t first = index_of_area(in, area);
    for (size_t i = 0; i < 2; i++) {
        in->area[i] = in->dialect->area[first ^ i];
        in->identity.aperture_mm[i] = area_mm[first ^ i];
    }
}

static enum driver_result fail_slider(const struct instrument *in, unsigned wanted,
                                      const char *code, struct driver_error *error)
{
    return driver_fail(error, DRIVER_REFUSED, code,
                       "the slider for the measuring area stands elsewhere: move it to %s, then "
                       "calibrate",
                       area_name[index_of_area(in, wanted)]);
}

enum driver_result km_query_settings(struct instrument *in, struct km_settings *ret,
                                     struct driver_error *error)
{
    struct km_reply reply;
    enum driver_result r =
        km_query(in, "CPR", in->dialect->settings_fields, km_deadline(in, 0), &reply, error);
    if (r == DRIVER_OK && !in->dialect->read_settings(&reply, ret))
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "the instrument's settings cannot be: is this the right driver?");
    return r;
}

enum driver_result km_set(struct instrument *in, const struct km_settings *settings,
                          struct driver_error *error)
{
    char command[KM_COMMAND_SIZE];
    struct km_settings are;
    in->dialect->write_settings(settings, command);
    enum driver_result r = km_command(in, command, 0, KM_CHARGING_MS, error);
    if (r == DRIVER_REFUSED && strcmp(error->code, "ER25") == 0 &&
        in->dialect->mes == KM_MES_THEN_MDR)
        return fail_slider(in, settings->area, error->code, error);
    if (r == DRIVER_OK)
        r = km_query_settings(in, &are, error);
    if (r != DRIVER_OK)
        return r;
    if (are.area != settings->area)
        return fail_slider(in, settings->area, NULL, error);
    if (are.averages != settings->averages || are.delay_ds != settings->delay_ds)
        return driver_fail(error, DRIVER_REFUSED, NULL,
                           "the instrument does not keep its settings: leave its menu, then try "
                           "again");
    in->settings = *settings;
    return DRIVER_OK;
}

enum driver_result km_set_user_calibration(struct instrument *in, bool on,
                                           struct driver_error *error)
{
    return km_command(in, on ? "USS,1" : "USS,0", 0, 0, error);
}

/* Somebody may have used the slider or the instrument's menu. */
enum driver_result km_check_settings(struct instrument *in, struct driver_error *error)
{
    struct km_settings are;
    enum driver_result r = km_query_settings(in, &are, error);
    if (r != DRIVER_OK)
        return r;
    if (are.area != in->settings.area)
        return fail_slider(in, in->settings.area, NULL, error);
    if (are.averages != in->settings.averages || are.delay_ds != in->settings.delay_ds)
        return km_set(in, &in->settings, error);
    return DRIVER_OK;
}

struct km_settings km_settings_for(const struct instrument *in, const struct driver_setup *setup)
{
    return (struct km_settings){
        .area = in->area[setup->aperture],
        .delay_ds = (unsigned)(setup->delay_ms + 99) / 100,
        .averages = setup->averages > 1 ? setup->averages : 1,
    };
}
