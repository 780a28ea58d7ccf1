/* guide.c - place, press Enter, calibrate; again where something else lay there. */
#include "cli/guide.h"

#include <math.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/log.h"
#include "cli/member.h"
#include "cli/prompt.h"

static const char *const step_names[] = { "zero", "white" };
enum { STEPS = sizeof step_names / sizeof *step_names };

/* ---- how a step stands -------------------------------------------------------------- */

static const cJSON *state_of(const cJSON *calibration, const char *step)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, calibration)
    {
        if (strcmp(member_text(one, "step"), step) == 0)
            return one;
    }
    return NULL;
}

bool guide_is_due(const cJSON *instrument)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, member(instrument, "calibration"))
    {
        if (member_true(one, "due"))
            return true;
    }
    return false;
}

const char *guide_cause(const cJSON *state)
{
    static const struct {
        const char *cause, *words;
    } causes[] = {
        { "never", "none on record" },
        { "instrument", "the instrument asks for it" },
        { "boot", "the last one was made before the machine was started" },
        { "reconnected", "the last one was made before the instrument was connected" },
        { "aperture", "the last one was made with another aperture" },
        { "expired", "the last one is too old" },
        { "earlier_step", "the step before it is due" },
    };
    const char *cause = member_text(state, "cause");
    for (size_t i = 0; i < sizeof causes / sizeof *causes; i++)
        if (strcmp(causes[i].cause, cause) == 0)
            return causes[i].words;
    return cause;
}

/* ---- telling ------------------------------------------------------------------------ */

const char *guide_duration(double seconds, char text[GUIDE_TIME_SIZE])
{
    double minutes = floor(seconds / 60.0), hours = floor(minutes / 60.0);
    if (minutes < 60.0)
        snprintf(text, GUIDE_TIME_SIZE, "%.0f min", minutes);
    else if (hours < 48.0)
        snprintf(text, GUIDE_TIME_SIZE, "%.0f h %.0f min", hours, minutes - 60.0 * hours);
    else
        snprintf(text, GUIDE_TIME_SIZE, "%.0f days %.0f h", floor(hours / 24.0), fmod(hours, 24.0));
    return text;
}

static void tell_until(FILE *to, double seconds)
{
    char clock[32] = "", text[GUIDE_TIME_SIZE];
    struct tm local;
    if (isnan(seconds))
        return;
    time_t until = time(NULL) + (time_t)seconds;
    if (localtime_r(&until, &local) != NULL)
        strftime(clock, sizeof clock, "%Y-%m-%d %H:%M", &local);
    fprintf(to, ", good until %s (%s)", clock, guide_duration(seconds, text));
}

static void tell_step(FILE *to, const char *step, const cJSON *state)
{
    /* What to place is only said of a step that is due. */
    static const char *const usual[STEPS] = { "put the black trap at the port",
                                              "put the white tile at the port" };
    const char *place = member_text(state, "place"), *cause = guide_cause(state);
    if (*place == '\0')
        place = usual[strcmp(step, step_names[0]) != 0];
    fprintf(to, "%s: %s%s%s%s\n", step, place, *cause != '\0' ? " (" : "", cause,
            *cause != '\0' ? ")" : "");
}

/* ---- doing -------------------------------------------------------------------------- */

/* Enter, with the lease kept meanwhile; events are passed over.  undone: what is not done where
 * nobody answers. */
static bool wait_for_enter(struct remote *remote, FILE *to, const char *undone)
{
    const struct remote_watch watch = { STDIN_FILENO, -1, -1 };
    struct prompt prompt = { .n = 0 };
    struct answer answer;
    prompt_forget();
    fputs("  then press Enter: ", to);
    fflush(to);
    for (;;) {
        enum remote_news news = remote_next(remote, &watch, &answer);
        if (news == REMOTE_LINE) {
            remote_done(&answer);
        } else if (news == REMOTE_INPUT) {
            enum prompt_line line = prompt_read(&prompt);
            if (line == PROMPT_ENTER)
                return true;
            if (line == PROMPT_END) {
                fputc('\n', to);
                log_error("not %s: standard input has ended", undone);
                return false;
            }
        } else {
            return false;
        }
    }
}

enum outcome { DONE, AGAIN, FAILED };

/* On DONE *calibration is how the steps stand now. */
static enum outcome make(struct remote *remote, const char *step, const struct guide *guide,
                         cJSON **calibration)
{
    struct answer answer;
    cJSON *params = remote_lease_params(remote);
    cJSON_AddStringToObject(params, "step", step);
    if (!remote_try(remote, METHOD_INSTRUMENT_CALIBRATE, params, &answer))
        return FAILED;
    enum outcome outcome = DONE;
    if (answer.error != NULL) {
        bool misplaced = remote_reason(&answer) == REASON_CALIBRATION_IMPLAUSIBLE;
        remote_complain(&answer);
        outcome = misplaced && !guide->yes ? AGAIN : FAILED;
    } else {
        cJSON_Delete(*calibration);
        *calibration = cJSON_Duplicate(member(answer.result, "calibration"), true);
        fputs("  done", guide->to);
        tell_until(guide->to, member_number(state_of(*calibration, step), "expires_in_s"));
        fputc('\n', guide->to);
        if (guide->steps != NULL)
            cJSON_AddItemToArray(guide->steps,
                                 cJSON_DetachItemFromObjectCaseSensitive(answer.tree, "result"));
    }
    remote_done(&answer);
    return outcome;
}

bool guide_calibrate(struct remote *remote, const cJSON *instrument, const struct guide *guide)
{
    cJSON *calibration = cJSON_Duplicate(member(instrument, "calibration"), true);
    bool good = true;
    for (size_t i = 0; i < STEPS && good; i++) {
        const cJSON *state = state_of(calibration, step_names[i]);
        enum outcome outcome = AGAIN;
        if (!guide->all && !member_true(state, "due"))
            continue;
        while (good && outcome == AGAIN) {
            tell_step(guide->to, step_names[i], state);
            good = guide->yes || wait_for_enter(remote, guide->to, "calibrated");
            if (good)
                outcome = make(remote, step_names[i], guide, &calibration);
        }
        good = outcome == DONE;
    }
    cJSON_Delete(calibration);
    return good;
}

bool guide_ready(struct remote *remote, const cJSON *instrument)
{
    const struct guide guide = { .to = stderr };
    if (!guide_is_due(instrument))
        return true;
    if (prompt_is_possible())
        return guide_calibrate(remote, instrument, &guide);
    log_error("a calibration is due, and standard input is no terminal to guide somebody at; run "
              "'skinspec calibrate' first");
    return false;
}

bool guide_place(struct remote *remote, FILE *to, const char *what)
{
    fprintf(to, "%s\n", what);
    return wait_for_enter(remote, to, "measured");
}
