/* ocean_ooi.c - the driver: opening, and the functions of the contract.
 *
 * session.c talks, reference.c calibrates and measures.  From top to bottom: opening (files, slots,
 * identity), doubting, the functions, the table of them. */
#include "drivers/ocean_ooi/ocean_ooi.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/ocean_ooi/address.h"
#include "drivers/ocean_ooi/reference.h"
#include "drivers/ocean_ooi/substitution.h"
#include "drivers/ocean_ooi/tile_file.h"

enum { OPEN_TIMEOUT_MS = 10000, REPLY_TIMEOUT_MS = 1000, MOST_AVERAGES = 100 };

/* By the data sheets. */
#define COLDEST_C 0.0
#define WARMEST_C 50.0

#define R_LEAST (-0.01)
#define R_MOST 2.0
#define R_OVER_RANGE 1.2
#define R_MEAN_LEAST 0.002
#define R_JUMP_MOST 0.35

struct instrument {
    struct ooi_session session;
    struct ooi_reference reference;
    struct ooi_address address;
    struct driver_identity identity;
    struct driver_setup setup;
    struct ooi_bands bands;
    struct ooi_tile_file tile;
    struct ooi_substitution substitution;  /* k all 0: none */
    char greys_sha256[OOI_FILE_HASH_SIZE]; /* of the file it was fitted to; "": none */
    double nm[OOI_MAX_PIXELS], rstd[OOI_MAX_PIXELS], rstd_band[OOI_BANDS];
    int64_t open_until_ms;
    bool tells_lamp; /* its status tells the lamp line as it was set */
};

/* ---- files -------------------------------------------------------------------------- */

static enum driver_result read_tile(struct instrument *in, struct driver_error *error)
{
    enum driver_result r = ooi_tile_read(in->address.tile, &in->tile, error);
    return r == DRIVER_OK ? ooi_tile_is_white(&in->tile, in->address.tile, error) : r;
}

/* The tile at each pixel and in each band.  Pixels outside the bands are not used. */
static void lay_tile(struct instrument *in)
{
    for (size_t p = 0; p < in->reference.n; p++) {
        double nm = fmin(fmax(in->nm[p], OOI_LOWEST_NM), OOI_HIGHEST_NM);
        in->rstd[p] = ooi_tile_at(&in->tile, 0, nm);
    }
    ooi_bands_apply(&in->bands, in->rstd, in->rstd_band);
}

static enum driver_result fit_greys(struct instrument *in, struct driver_error *error)
{
    double measured[OOI_TILE_ROWS][OOI_BANDS], certified[OOI_TILE_ROWS][OOI_BANDS];
    struct ooi_tile_file *greys;
    size_t n = 0;
    if (in->address.greys[0] == '\0')
        return DRIVER_OK;
    greys = malloc(sizeof *greys);
    if (greys == NULL)
        return driver_fail(error, DRIVER_FAULT, NULL, "not enough memory");
    enum driver_result r = ooi_tile_read(in->address.greys, greys, error);
    if (r == DRIVER_OK)
        r = ooi_tile_greys(greys, in->address.greys, &n, measured, certified, error);
    if (r == DRIVER_OK)
        memcpy(in->greys_sha256, greys->sha256, sizeof in->greys_sha256);
    free(greys);
    if (r != DRIVER_OK)
        return r;
    if (ooi_substitution_fit(n, measured, certified, in->rstd_band, &in->substitution) != STATUS_OK)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "%.200s: these greys do not behave as in a sphere (k %.3f at 550 nm, "
                           "rms %.4f after the correction): measure them again without greys=, "
                           "after a calibration with this white tile",
                           in->address.greys, in->substitution.k[15], in->substitution.residual);
    return DRIVER_OK;
}

/* ---- slots -------------------------------------------------------------------------- */

static enum driver_result late_open(struct driver_error *error)
{
    return driver_fail(error, DRIVER_TIMEOUT, NULL,
                       "the spectrometer answers too slowly: connect it again, without a hub");
}

/* A slot that must hold a number; *ret is untouched where it is empty and may be. */
static enum driver_result slot_number(struct instrument *in, uint8_t slot, bool may_be_empty,
                                      double *ret, struct driver_error *error)
{
    char text[OOI_SLOT_TEXT];
    if (call_now_ms() > in->open_until_ms)
        return late_open(error);
    enum driver_result r = ooi_get_slot(&in->session, slot, text, error);
    if (r != DRIVER_OK || (may_be_empty && text[0] == '\0'))
        return r;
    if (!ooi_read_number(text, ret))
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "EEPROM slot %u of the spectrometer holds '%s', no number: have it "
                           "programmed anew by its maker",
                           slot, text);
    return DRIVER_OK;
}

static enum driver_result read_wavelengths(struct instrument *in, struct driver_error *error)
{
    const struct ooi_model *m = in->session.model;
    struct ooi_reference *ref = &in->reference;
    double c[4];
    for (uint8_t i = 0; i < 4; i++) {
        enum driver_result r =
            slot_number(in, (uint8_t)(OOI_SLOT_WAVELENGTH + i), false, &c[i], error);
        if (r != DRIVER_OK)
            return r;
    }
    ref->n = m->active_last - m->active_first + 1;
    ooi_wavelengths(c, m->active_first, ref->n, in->nm);
    if (ooi_bands_init(ref->n, in->nm, &in->bands) != STATUS_OK)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "this spectrometer sees %.0f to %.0f nm by its EEPROM; 390 to 710 nm "
                           "are needed, rising from pixel to pixel",
                           in->nm[0], in->nm[ref->n - 1]);
    ref->bands = &in->bands;
    ref->rstd = in->rstd;
    ref->first_used = in->bands.first[0];
    ref->end_used = in->bands.first[OOI_BANDS - 1] + in->bands.n[OOI_BANDS - 1];
    return DRIVER_OK;
}

static enum driver_result read_detector(struct instrument *in, struct driver_error *error)
{
    double n[OOI_NONLINEARITY] = { 0.0 }, order = OOI_NONLINEARITY - 1;
    uint16_t level = 0;
    enum driver_result r = DRIVER_OK;
    for (uint8_t i = 0; r == DRIVER_OK && i < OOI_NONLINEARITY; i++)
        r = slot_number(in, (uint8_t)(OOI_SLOT_NONLINEARITY + i), true, &n[i], error);
    if (r == DRIVER_OK)
        r = slot_number(in, OOI_SLOT_ORDER, true, &order, error);
    if (r == DRIVER_OK)
        r = ooi_get_level(&in->session, &level, error);
    if (r != DRIVER_OK)
        return r;
    if (!(order >= 0.0 && order < OOI_NONLINEARITY) || order != floor(order) ||
        ooi_detector_init(in->session.model, level, (size_t)order, n, &in->reference.detector) !=
            STATUS_OK)
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "the spectrometer's EEPROM holds no sound linearity (order %g, n0 %g, "
                           "saturation level %u): have it programmed anew by its maker",
                           order, n[0], level);
    return DRIVER_OK;
}

/* ---- who it is --------------------------------------------------------------------------------
 */

/* The PID that the link's address names, "usb:2457:101e"; 0: none. */
static uint16_t pid_in(const char *link)
{
    static const char maker[] = "usb:2457:";
    char *end;
    if (strncmp(link, maker, strlen(maker)) != 0 || strlen(link) != strlen(maker) + 4)
        return 0;
    unsigned long pid = strtoul(link + strlen(maker), &end, 16);
    return *end == '\0' && pid <= UINT16_MAX ? (uint16_t)pid : 0;
}

/* Which model: as the link or the address says, else by its pixels. */
static enum driver_result find_model(struct instrument *in, uint16_t pid,
                                     const struct ooi_status *status, struct driver_error *error)
{
    const struct ooi_model *by_pid = ooi_model_of_pid(pid != 0 ? pid : pid_in(in->address.link));
    const struct ooi_model *m = by_pid != NULL ? by_pid : in->address.model;
    if (by_pid != NULL && in->address.model != NULL && in->address.model != by_pid)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "this is a %s and no %s: leave out model=", by_pid->name,
                           in->address.model->name);
    for (const struct ooi_model *any = ooi_models; m == NULL && any->name != NULL; any++)
        if (status->pixels == any->pixels || status->pixels == any->pixels_shown)
            m = any;
    if (m == NULL || (status->pixels != m->pixels && status->pixels != m->pixels_shown))
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "a spectrometer with %zu pixels is none of this driver's%s%s",
                           status->pixels, m != NULL ? ", nor a " : "", m != NULL ? m->name : "");
    in->session.model = m;
    in->session.high_speed = status->high_speed;
    return DRIVER_OK;
}

static void name_model(struct instrument *in, uint16_t version)
{
    const struct ooi_model *m = in->session.model;
    struct driver_identity *id = &in->identity;
    unsigned major = version >> 12;
    snprintf(id->model, sizeof id->model, "%s",
             major >= 3 && m->successor != NULL ? m->successor : m->name);
    snprintf(id->firmware, sizeof id->firmware, "FPGA %u.%u.%u", major, version >> 8 & 0xfu,
             version & 0xffu);
}

/* Part of what made the readings, and the one member of an identity that records refer to and
 * that is not the unit's own name. */
static void name_correction(struct instrument *in)
{
    char *firmware = in->identity.firmware;
    size_t n = strlen(firmware);
    if (in->greys_sha256[0] != '\0')
        snprintf(firmware + n, DRIVER_NAME_SIZE - n, ", greys %.16s", in->greys_sha256);
}

static void fill_identity(struct instrument *in)
{
    struct driver_identity *id = &in->identity;
    snprintf(id->maker, sizeof id->maker, "Ocean Optics");
    snprintf(id->white_tile, sizeof id->white_tile, "%s", in->tile.row[0].id);
    name_correction(in);
    id->geometry = DRIVER_GEOMETRY_D8;
    id->has_sce = true;
    id->grid[0] = (struct driver_grid){ OOI_FIRST_NM, OOI_STEP_NM, OOI_BANDS };
    id->grids = 1;
    id->aperture_mm[0] = in->address.port_mm;
    id->apertures = 1;
    id->max_averages = MOST_AVERAGES;
}

/* What the spectrometer says of itself. */
static enum driver_result introduce(struct instrument *in, uint16_t pid, struct driver_error *error)
{
    struct ooi_status status = { .pixels = 0 };
    uint16_t version = 0;
    char serial[OOI_SLOT_TEXT];
    enum driver_result r = ooi_restart(&in->session, error);
    if (r == DRIVER_OK)
        r = ooi_get_status(&in->session, &status, error);
    if (r == DRIVER_OK)
        r = find_model(in, pid, &status, error);
    if (r == DRIVER_OK)
        r = ooi_get_register(&in->session, OOI_FPGA_VERSION, &version, error);
    if (r == DRIVER_OK)
        r = ooi_get_slot(&in->session, OOI_SLOT_SERIAL, serial, error);
    if (r != DRIVER_OK)
        return r;
    in->tells_lamp = status.lamp;
    name_model(in, version);
    memcpy(in->identity.serial, serial, sizeof serial);
    r = read_wavelengths(in, error);
    return r == DRIVER_OK ? read_detector(in, error) : r;
}

/* ---- opening ------------------------------------------------------------------------ */

static enum driver_result take_hold(struct instrument *in, const struct driver_options *options,
                                    uint16_t *pid, struct driver_error *error)
{
    static const struct link_usb_model models[] = {
        { OOI_VID, 0x101e }, { OOI_VID, 0x1022 }, { OOI_VID, 0x1016 }, { OOI_VID, 0x1012 }, { 0, 0 }
    };
    const struct link_usb usb = { .models = models, .interface = 0, .pid = pid };
    const struct link_wanted wanted = { .address = in->address.link,
                                        .call = &in->session.call,
                                        .usb = &usb,
                                        .deadline_ms = in->open_until_ms };
    *pid = 0;
    enum driver_result r = link_open(options, &wanted, &in->session.link, error);
    if (r == DRIVER_OK)
        link_begin(in->session.link, "open");
    return r;
}

static void ocean_close(struct instrument *in)
{
    if (in == NULL)
        return;
    link_close(in->session.link);
    call_done(&in->session.call);
    free(in);
}

static enum driver_result ocean_open(const struct driver_options *options, struct instrument **ret,
                                     struct driver_identity *identity, struct driver_error *error)
{
    int open_ms = options->open_timeout_ms > 0 ? options->open_timeout_ms : OPEN_TIMEOUT_MS;
    uint16_t pid = 0;
    struct instrument *in = calloc(1, sizeof *in);
    if (in == NULL || !call_init(&in->session.call)) {
        free(in);
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory or no descriptor left");
    }
    in->open_until_ms = call_now_ms() + open_ms;
    in->session.reply_timeout_ms =
        options->reply_timeout_ms > 0 ? options->reply_timeout_ms : REPLY_TIMEOUT_MS;
    in->reference.session = &in->session;

    enum driver_result r =
        ooi_address_parse(options->address != NULL ? options->address : "", &in->address, error);
    if (r == DRIVER_OK)
        r = read_tile(in, error);
    if (r == DRIVER_OK)
        r = take_hold(in, options, &pid, error);
    if (r == DRIVER_OK)
        r = introduce(in, pid, error);
    if (r == DRIVER_OK) {
        lay_tile(in);
        r = fit_greys(in, error);
    }
    if (r != DRIVER_OK) {
        ocean_close(in);
        return r;
    }
    fill_identity(in);
    *identity = in->identity;
    *ret = in; /* the caller owns it now; close() gives it back */
    return DRIVER_OK;
}

/* ---- temperature -------------------------------------------------------------------- */

/* NAN where it is not known. */
static enum driver_result get_temperature(struct instrument *in, double *celsius,
                                          struct driver_error *error)
{
    *celsius = NAN;
    return in->session.model->tells_temperature ? ooi_get_temperature(&in->session, celsius, error)
                                                : DRIVER_OK;
}

/* ---- doubting ----------------------------------------------------------------------- */

/* Whether it still is as it was set: one that was reset in between has lost lamp and time. */
static enum driver_result check_state(struct instrument *in, struct driver_error *error)
{
    struct ooi_status status = { .pixels = 0 };
    enum driver_result r = ooi_get_status(&in->session, &status, error);
    if (r != DRIVER_OK)
        return r;
    if (status.integration_us == in->session.integration_us && (status.lamp || !in->tells_lamp))
        return DRIVER_OK;
    in->reference.white = false;
    in->session.out_of_step = true; /* sets it anew */
    return driver_fail(error, DRIVER_REFUSED, NULL,
                       "the spectrometer was reset by itself: check its cable, let the lamp warm "
                       "up, then calibrate white again");
}

static enum driver_result doubt(const double R[OOI_BANDS], struct driver_error *error)
{
    double sum = 0.0;
    for (size_t b = 0; b < OOI_BANDS; b++) {
        double nm = OOI_FIRST_NM + (double)b * OOI_STEP_NM;
        if (!(R[b] >= R_LEAST && R[b] <= R_MOST)) /* NAN neither */
            return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                               "%.4f at %.0f nm is no reflectance: calibrate zero and white, then "
                               "measure again",
                               R[b], nm);
        if (b > 0 && fabs(R[b] - R[b - 1]) > R_JUMP_MOST)
            return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                               "the reflectance jumps by %.2f at %.0f nm, as no sample does: keep "
                               "other light from the port, then measure again",
                               fabs(R[b] - R[b - 1]), nm);
        sum += R[b];
    }
    if (sum / OOI_BANDS < R_MEAN_LEAST)
        return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                           "no light came back at all: is the lamp on, and a sample at the port?");
    return DRIVER_OK;
}

/* ---- the functions -----------------------------------------------------------------------------
 */

static void ocean_cancel(struct instrument *in)
{
    call_cancel(&in->session.call);
}

/* The spectrometer is not asked: all that can be chosen is how many spectra are averaged. */
static enum driver_result ocean_configure(struct instrument *in, const struct driver_setup *setup,
                                          struct driver_error *error)
{
    enum driver_result r = driver_check_setup(&in->identity, setup, error);
    if (r == DRIVER_OK)
        in->setup = *setup;
    return r;
}

static enum driver_result ocean_status(struct instrument *in, struct driver_status *ret,
                                       struct driver_error *error)
{
    struct driver_status status = { .battery_percent = -1, .temperature_C = NAN };
    enum driver_result r = ooi_begin(&in->session, "status", error);
    struct ooi_status answer = { .pixels = 0 };
    if (r == DRIVER_OK) /* whether it is there at all */
        r = ooi_get_status(&in->session, &answer, error);
    if (r == DRIVER_OK)
        r = get_temperature(in, &status.temperature_C, error);
    if (r != DRIVER_OK)
        return r;
    status.due[DRIVER_CALIBRATION_ZERO] = !in->reference.zero;
    status.due[DRIVER_CALIBRATION_WHITE] = !in->reference.white;
    if (!in->reference.zero)
        snprintf(status.place[DRIVER_CALIBRATION_ZERO], DRIVER_TEXT_SIZE,
                 "put the black trap at the port; leave the lamp on and the gloss trap open");
    if (!in->reference.white)
        snprintf(status.place[DRIVER_CALIBRATION_WHITE], DRIVER_TEXT_SIZE,
                 "put white tile %s flat on the port; leave the gloss trap open",
                 in->identity.white_tile);
    *ret = status;
    return DRIVER_OK;
}

static unsigned averages(const struct instrument *in)
{
    return in->setup.averages > 1 ? in->setup.averages : 1;
}

static enum driver_result refuse_without_zero(struct driver_error *error)
{
    return driver_fail(error, DRIVER_REFUSED, NULL,
                       "zero calibration is due: put the black trap at the port, then calibrate");
}

static enum driver_result ocean_calibrate(struct instrument *in, enum driver_calibration step,
                                          struct driver_error *error)
{
    struct ooi_reference *ref = &in->reference;
    if (step != DRIVER_CALIBRATION_ZERO && step != DRIVER_CALIBRATION_WHITE)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "no such calibration");
    bool zero = step == DRIVER_CALIBRATION_ZERO;
    enum driver_result r =
        ooi_begin(&in->session, zero ? "calibrate zero" : "calibrate white", error);
    if (r != DRIVER_OK)
        return r;
    if (zero)
        return ooi_calibrate_zero(ref, averages(in), error);
    return ref->zero ? ooi_calibrate_white(ref, averages(in), error) : refuse_without_zero(error);
}

static void fill_reading(const struct instrument *in, const double R[OOI_BANDS], double celsius,
                         struct driver_reading *ret)
{
    memset(ret, 0, sizeof *ret);
    ret->has_sce = true;
    ret->sce.first_nm = OOI_FIRST_NM;
    ret->sce.step_nm = OOI_STEP_NM;
    ret->sce.n = OOI_BANDS;
    ret->sce.specular = SPECULAR_SCE;
    ret->sce.aperture_mm = in->address.port_mm;
    for (size_t b = 0; b < OOI_BANDS; b++) {
        ret->sce.value[b] = fmax(R[b], 0.0);
        ret->sce.flag[b] = R[b] < 0.0 ? SPECTRUM_BAND_ZEROED : 0;
        if (R[b] > R_OVER_RANGE)
            ret->warnings |= DRIVER_WARNING_OVER_RANGE;
    }
    if (celsius < COLDEST_C || celsius > WARMEST_C)
        ret->warnings |= DRIVER_WARNING_TEMPERATURE;
}

static enum driver_result ocean_measure(struct instrument *in, struct driver_reading *ret,
                                        struct driver_error *error)
{
    struct ooi_reference *ref = &in->reference;
    double R[OOI_BANDS], celsius = NAN;
    enum driver_result r = ooi_begin(&in->session, "measure", error);
    if (r != DRIVER_OK)
        return r;
    if (!ref->zero)
        return refuse_without_zero(error);
    if (!ref->white)
        return driver_fail(error, DRIVER_REFUSED, NULL,
                           "white calibration is due: put white tile %s on the port, then "
                           "calibrate",
                           in->identity.white_tile);
    r = ooi_measure_sample(ref, averages(in), R, error);
    if (r == DRIVER_OK)
        r = check_state(in, error);
    if (r == DRIVER_OK)
        r = get_temperature(in, &celsius, error);
    if (r != DRIVER_OK)
        return r;
    ooi_substitution_correct(&in->substitution, in->rstd_band, R);
    r = doubt(R, error);
    if (r == DRIVER_OK)
        fill_reading(in, R, celsius, ret);
    return r;
}

static const struct driver_match matches[] = {
    { OOI_VID, 0x101e, DRIVER_BUS_USB },
    { OOI_VID, 0x1022, DRIVER_BUS_USB },
    { OOI_VID, 0x1016, DRIVER_BUS_USB },
    { OOI_VID, 0x1012, DRIVER_BUS_USB },
    { 0, 0, DRIVER_BUS_USB },
};

const struct driver ocean_ooi_driver = {
    .name = "ocean_ooi",
    .description = "Ocean USB2000+, USB4000, Flame, HR on a sphere: "
                   "usb[:VID:PID|:BUS:DEV],tile=FILE,port_mm=N[,greys=FILE]",
    .matches = matches,
    .open = ocean_open,
    .close = ocean_close,
    .cancel = ocean_cancel,
    .configure = ocean_configure,
    .status = ocean_status,
    .calibrate = ocean_calibrate,
    .measure = ocean_measure,
};
