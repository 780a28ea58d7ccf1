/* measuring.c - shots are checked one by one and as a set, then become a record. */
#include "station/measuring.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "colour/lab.h"

/* ---- life --------------------------------------------------------------------------- */

/* Weights for the redness; none where the bands give no colour. */
static enum status make_weights(struct measuring *m)
{
    m->weights = malloc(sizeof *m->weights);
    if (m->weights == NULL)
        return STATUS_NO_MEMORY;
    if (xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, m->bands.first_nm, m->bands.step_nm,
                         m->bands.n, m->weights) != STATUS_OK) {
        free(m->weights);
        m->weights = NULL;
    }
    return STATUS_OK;
}

enum status measuring_init(struct measuring *m)
{
    m->taken = 0;
    m->flags = m->set_flags = m->warnings = 0;
    m->lift_probe = false;
    m->weights = NULL;
    m->reading = NULL;
    m->matched = NULL;
    if (m->replicates < 1 || m->replicates > QUALITY_MAX_REPLICATES)
        return STATUS_RANGE;
    m->reading = calloc(m->replicates, sizeof *m->reading);
    m->matched = calloc(m->replicates, sizeof *m->matched);
    enum status s = m->reading == NULL || m->matched == NULL ? STATUS_NO_MEMORY : make_weights(m);
    if (s != STATUS_OK)
        measuring_done(m);
    return s;
}

void measuring_done(struct measuring *m)
{
    free(m->reading);
    free(m->matched);
    free(m->weights);
    m->reading = NULL;
    m->matched = NULL;
    m->weights = NULL;
}

/* ---- one shot ----------------------------------------------------------------------- */

static enum measuring_step refuse(const struct measuring *m, struct refusal *refusal,
                                  const char *why)
{
    refusal_set(refusal, REASON_MEASUREMENT_FAILED, "shot %zu: %s", m->taken + 1, why);
    return MEASURING_REFUSE;
}

/* What was asked for, the instrument can give. */
static bool can_be_had(const struct measuring *m, const struct driver_reading *reading,
                       struct refusal *refusal)
{
    bool is_sci = m->specular == SPECULAR_SCI;
    if (is_sci ? !reading->has_sci : !reading->has_sce) {
        refusal_set(refusal, REASON_INSTRUMENT_UNSUPPORTED, "it does not measure %s",
                    specular_name(m->specular));
        return false;
    }
    if (is_sci && !(m->surface >= 0.0 && m->surface <= SPECTRUM_SURFACE_MAX)) {
        refusal_set(refusal, REASON_SURFACE_NEEDED, NULL);
        return false;
    }
    return true;
}

static const struct spectrum *matched_of(const struct measuring *m,
                                         const struct driver_reading *reading)
{
    return m->specular == SPECULAR_SCI ? &reading->sci : &reading->sce;
}

/* Bits of enum quality_flag of a shot by itself. */
static unsigned check_shot(const struct measuring *m, const struct driver_reading *reading)
{
    const struct driver_reading *first = m->taken > 0 ? &m->reading[0] : reading;
    if (reading->has_sce != first->has_sce || reading->has_sci != first->has_sci)
        return QUALITY_WRONG_BANDS;
    if (!reading->has_sce || !reading->has_sci)
        return quality_shot(&m->bands, matched_of(m, reading), NULL);
    return quality_shot(&m->bands, &reading->sce, &reading->sci);
}

static const char *text_of_lowest(unsigned flags)
{
    size_t i = 0;
    while ((flags >> i & 1u) == 0)
        i++;
    return quality_flag_text(i);
}

static bool is_other_port(double aperture_mm, double set_mm)
{
    return isfinite(aperture_mm) && isfinite(set_mm) && aperture_mm != set_mm;
}

static double redness(const struct measuring *m, const struct spectrum *s)
{
    double XYZ[3], Lab[3];
    if (m->weights == NULL)
        return NAN;
    xyz_from_reflectance(m->weights, s->value, XYZ);
    lab_from_xyz(XYZ, m->weights->white, Lab);
    return Lab[1];
}

static void keep(struct measuring *m, const struct driver_reading *reading)
{
    m->reading[m->taken] = *reading;
    m->matched[m->taken] = *matched_of(m, reading);
    m->a_star[m->taken] = redness(m, matched_of(m, reading));
    m->warnings |= reading->warnings;
    m->taken++;
}

/* Flags that the shots so far raise together, and did not before the last of them. */
static unsigned judge_set(struct measuring *m)
{
    struct quality_set set;
    unsigned before = m->set_flags;
    (void)quality_of_set(m->matched, m->a_star, m->taken, &set); /* bands are alike */
    m->set_flags = set.flags & ~(unsigned)QUALITY_SINGLE;        /* more may come */
    m->lift_probe = set.lift_probe;
    return m->set_flags & ~before;
}

enum measuring_step measuring_take(struct measuring *m, const struct driver_reading *reading,
                                   unsigned *shot_flags, struct refusal *refusal)
{
    *shot_flags = 0;
    if (!can_be_had(m, reading, refusal))
        return MEASURING_REFUSE;
    *shot_flags = check_shot(m, reading);
    if ((*shot_flags & QUALITY_REFUSED) != 0)
        return refuse(m, refusal, text_of_lowest(*shot_flags));
    if (is_other_port(matched_of(m, reading)->aperture_mm, m->bands.aperture_mm))
        return refuse(m, refusal, "taken through another port than is set; move the slider back");
    m->flags |= *shot_flags;
    keep(m, reading);
    *shot_flags |= judge_set(m);
    if (m->taken == m->replicates)
        return MEASURING_FINISH;
    return m->prompt ? MEASURING_WAIT : MEASURING_SHOOT;
}

const char *measuring_prompt(const struct measuring *m)
{
    if (m->lift_probe)
        return "Lift the probe, wait until the skin has its colour back, and put it down lightly "
               "on the same site.";
    return "Put the probe on the same site for the next shot.";
}

/* ---- the record --------------------------------------------------------------------- */

/* Tokens of flags[] of which the bits are set, as the inside of a JSON array. */
static void add_tokens(char *text, size_t size, unsigned bits, const char *(*name)(size_t bit),
                       size_t n)
{
    for (size_t i = 0; i < n; i++) {
        size_t used = strlen(text);
        if ((bits >> i & 1u) != 0)
            snprintf(text + used, size - used, "%s\"%s\"", used > 1 ? "," : "", name(i));
    }
}

/* The instrument's calibration_old and the station's are one flag. */
static void fill_flags(unsigned flags, unsigned warnings, struct store_record *record)
{
    if ((warnings & DRIVER_WARNING_CALIBRATION_OLD) != 0)
        flags |= QUALITY_CALIBRATION_OLD;
    warnings &= ~(unsigned)DRIVER_WARNING_CALIBRATION_OLD;
    strcpy(record->flags, "[");
    add_tokens(record->flags, sizeof record->flags, flags, quality_flag_name, QUALITY_FLAGS);
    add_tokens(record->flags, sizeof record->flags, warnings, driver_warning_name, DRIVER_WARNINGS);
    strcat(record->flags, "]");
}

/* Reflectance of a count; NAN where there are no counts, or not the same in all shots. */
static double raw_unit(const struct measuring *m)
{
    double unit = m->reading[0].raw_unit;
    for (size_t i = 1; i < m->taken; i++)
        if (m->reading[i].raw_unit != unit)
            return NAN;
    return unit > 0.0 ? unit : NAN;
}

static int32_t *append(int32_t *to, const int32_t *raw, size_t n)
{
    memcpy(to, raw, n * sizeof *raw);
    return to + n;
}

/* Shot after shot, the modes there are, band after band.  False: no memory. */
static bool collect_raw(const struct measuring *m, int32_t **ret, size_t *n)
{
    const struct driver_reading *first = &m->reading[0];
    size_t modes = (size_t)first->has_sce + (size_t)first->has_sci;
    int32_t *end = *ret = calloc(m->taken * modes * m->bands.n, sizeof **ret);
    if (*ret == NULL)
        return false;
    for (size_t i = 0; i < m->taken; i++) {
        if (first->has_sce)
            end = append(end, m->reading[i].raw_sce, m->bands.n);
        if (first->has_sci)
            end = append(end, m->reading[i].raw_sci, m->bands.n);
    }
    *n = (size_t)(end - *ret);
    return true;
}

static void fill_replicates(const struct measuring *m, struct store_record *record)
{
    record->replicates = m->taken;
    for (size_t i = 0; i < m->taken; i++) {
        const struct driver_reading *reading = &m->reading[i];
        record->replicate[i].n = record->replicate_sci[i].n = 0;
        if (reading->has_sce)
            record->replicate[i] = reading->sce;
        if (reading->has_sci)
            record->replicate_sci[i] = reading->sci;
    }
}

/* SCI less the surface. */
static bool take_surface_off(const struct measuring *m, struct spectrum *mean,
                             struct refusal *refusal)
{
    size_t band = 0;
    if (spectrum_remove_surface(mean, m->surface, &band) == STATUS_OK)
        return true;
    refusal_set(refusal, REASON_MEASUREMENT_FAILED,
                "at %g nm %.4f came back, less than the surface of %g alone would give",
                spectrum_nm(mean, band), mean->value[band], m->surface);
    return false;
}

bool measuring_finish(const struct measuring *m, unsigned extra, struct store_record *record,
                      struct refusal *refusal)
{
    struct quality_set set;
    bool is_sci = m->specular == SPECULAR_SCI;
    int32_t *raw = NULL;
    size_t raw_n = 0;
    if (quality_of_set(m->matched, m->a_star, m->taken, &set) != STATUS_OK) {
        refusal_set(refusal, REASON_MEASUREMENT_FAILED, "no shot was taken");
        return false;
    }
    if (is_sci && !take_surface_off(m, &set.mean, refusal))
        return false;
    double unit = raw_unit(m);
    if (!isnan(unit) && !collect_raw(m, &raw, &raw_n)) {
        refusal_set(refusal, REASON_NO_MEMORY, NULL);
        return false;
    }
    record->raw = raw;
    record->raw_n = raw_n;
    record->raw_unit = unit;
    record->spectrum = set.mean;
    record->specular = set.mean.specular;
    record->aperture_mm = set.mean.aperture_mm;
    record->surface = is_sci ? m->surface : NAN;
    fill_replicates(m, record);
    fill_flags(m->flags | set.flags | extra, m->warnings, record);
    return true;
}
