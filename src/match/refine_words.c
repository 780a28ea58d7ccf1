/* refine_words.c - the flags of a refined answer as tokens and as sentences. */
#include "match/refine.h"

const char *refine_flag_name(size_t i)
{
    static const char *const name[REFINE_FLAG_COUNT] = {
        "Cm_at_bound",
        "Bm_at_bound",
        "Ch_at_bound",
        "SO2_at_bound",
        "epidermis_mm_at_bound",
        "scattering_a_at_bound",
        "scattering_b_at_bound",
        "Cm_undetermined",
        "Bm_undetermined",
        "Ch_undetermined",
        "SO2_undetermined",
        "epidermis_mm_undetermined",
        "scattering_a_undetermined",
        "scattering_b_undetermined",
        "Cm_by_prior",
        "Bm_by_prior",
        "Ch_by_prior",
        "SO2_by_prior",
        "epidermis_mm_by_prior",
        "scattering_a_by_prior",
        "scattering_b_by_prior",
        "residual_too_large",
        "residual_too_small",
        "second_solution",
        "not_converged",
    };
    return i < REFINE_FLAG_COUNT ? name[i] : "unknown";
}

/* Where pigment is this dark, it is why blood cannot be told; and where it is this light,
 * why the blend cannot.  Between them noise is why. */
#define DARK_CM 0.1
#define LIGHT_CM 0.01

static const char *undetermined(const struct refined *r, enum skin_parameter i)
{
    static const char *const sentence[SKIN_PARAMETERS] = {
        [SKIN_CM] = "Cm cannot be told from this spectrum",
        [SKIN_BM] = "Bm cannot be told from this spectrum",
        [SKIN_CH] = "Ch cannot be told from this spectrum",
        [SKIN_SO2] = "SO2 cannot be told from this spectrum",
        [SKIN_EPIDERMIS_MM] = "the thickness of the epidermis cannot be told from this spectrum",
        [SKIN_SCATTERING_A] = "the size of the scattering cannot be told from this spectrum",
        [SKIN_SCATTERING_B] = "the slope of the scattering cannot be told from this spectrum",
    };
    if (i == SKIN_BM && (r->value[SKIN_CM] <= LIGHT_CM || r->value[SKIN_CM] >= DARK_CM))
        return "Bm cannot be told at this melanin";
    if (i == SKIN_CH && r->value[SKIN_CM] >= DARK_CM)
        return "Ch cannot be told in skin this dark";
    if (i == SKIN_SO2 && r->value[SKIN_CM] >= DARK_CM)
        return "SO2 cannot be told in skin this dark";
    return sentence[i];
}

static const char *by_prior(enum skin_parameter i)
{
    static const char *const sentence[SKIN_PARAMETERS] = {
        [SKIN_CM] = "Cm is what was assumed of it, more than what the spectrum shows",
        [SKIN_BM] = "Bm is what was assumed of it, more than what the spectrum shows",
        [SKIN_CH] = "Ch is what was assumed of it, more than what the spectrum shows",
        [SKIN_SO2] = "SO2 is what was assumed of it, more than what the spectrum shows",
        [SKIN_EPIDERMIS_MM] = "the thickness of the epidermis is what was assumed of it, more "
                              "than what the spectrum shows",
        [SKIN_SCATTERING_A] = "the size of the scattering is what was assumed of it, more than "
                              "what the spectrum shows",
        [SKIN_SCATTERING_B] = "the slope of the scattering is what was assumed of it, more than "
                              "what the spectrum shows",
    };
    return sentence[i];
}

static const char *at_bound(enum skin_parameter i)
{
    static const char *const sentence[SKIN_PARAMETERS] = {
        [SKIN_CM] = "Cm came to rest at the end of its range: what would fit better lies beyond",
        [SKIN_BM] = "Bm came to rest at the end of its range: what would fit better lies beyond",
        [SKIN_CH] = "Ch came to rest at the end of its range: what would fit better lies beyond",
        [SKIN_SO2] = "SO2 came to rest at the end of its range: what would fit better lies beyond",
        [SKIN_EPIDERMIS_MM] = "the thickness of the epidermis came to rest at the end of its "
                              "range: what would fit better lies beyond",
        [SKIN_SCATTERING_A] = "the size of the scattering came to rest at the end of its range: "
                              "what would fit better lies beyond",
        [SKIN_SCATTERING_B] = "the slope of the scattering came to rest at the end of its range: "
                              "what would fit better lies beyond",
    };
    return sentence[i];
}

/* One sentence a parameter: that it cannot be told says more than where it came to rest. */
static const char *of_parameter(const struct refined *r, enum skin_parameter i)
{
    if (r->flags & (unsigned)REFINE_BY_PRIOR << i)
        return by_prior(i);
    if (r->flags & (unsigned)REFINE_UNDETERMINED << i)
        return undetermined(r, i);
    if (r->flags & (unsigned)REFINE_AT_BOUND << i)
        return at_bound(i);
    return NULL;
}

const char *refine_words(const struct refined *r, size_t i)
{
    static const struct {
        unsigned flag;
        const char *sentence;
    } single[] = {
        { REFINE_RESIDUAL_TOO_LARGE, "the model does not explain the spectrum to within the noise "
                                     "stated: the intervals are too narrow" },
        { REFINE_RESIDUAL_TOO_SMALL, "the spectrum fits better than the noise stated would let "
                                     "it: the intervals are too wide" },
        { REFINE_SECOND_SOLUTION, "another skin fits nearly as well" },
        { REFINE_NOT_CONVERGED, "the fit ended at its limit of steps: better may be near" },
    };
    size_t told = 0;
    for (size_t k = 0; k < SKIN_PARAMETERS; k++) {
        const char *sentence = of_parameter(r, (enum skin_parameter)k);
        if (sentence != NULL && told++ == i)
            return sentence;
    }
    for (size_t k = 0; k < sizeof single / sizeof *single; k++)
        if ((r->flags & single[k].flag) != 0 && told++ == i)
            return single[k].sentence;
    return NULL;
}
