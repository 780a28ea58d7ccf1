/* test_method.c - what is timed of a method is what a scene does. */
#include "trial/method.h"

#include <math.h>

#include "plan/plan_run.h"
#include "trial/skins.h"
#include "unity.h"

enum { SKINS = 8 };

static struct trial_skins skins;
static struct trial_spectra spectra;

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_skins_init(SKINS, 1, &skins));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          trial_spectra_init(&skins, model_find("two-layer"), 1, &spectra));
}

void tearDown(void)
{
    trial_spectra_done(&spectra);
    trial_skins_done(&skins);
}

/* Spectra of the model that the plan of a scene takes; of the same fit. */
static size_t evaluations_of_plan(unsigned wanted, const struct spectrum *measured)
{
    const struct plan_at_hand hand = { costs_builtin(), NULL,          0,
                                       TRIAL_FIRST_NM,  TRIAL_STEP_NM, TRIAL_BANDS };
    struct scene scene = scene_empty();
    struct plan plan;
    struct plan_runner *runner = NULL;
    struct plan_answer answer;
    struct plan_work work = { 0 };
    char why[SCENE_WHY_SIZE] = "";
    scene.wanted = wanted;
    scene.model = model_find("two-layer");
    scene.white = TRIAL_NOISE;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, plan_make(&scene, &hand, &plan, why), why);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, plan_open(&plan, NULL, &runner, NULL));
    enum status s = plan_run(runner, measured, 1, measured, NULL, &answer, &work, NULL);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, s);
    plan_close(runner);
    return work.evaluations;
}

static void compare(bool interval, unsigned wanted)
{
    const struct trial_method method = { .model = model_find("two-layer"),
                                         .by = MATCH_SPECTRUM,
                                         .refine = REFINE_THREE,
                                         .interval = interval };
    struct trial_ready ready;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_ready_init(&method, NULL, &ready));
    for (size_t i = 0; i < SKINS; i++) {
        struct spectrum measured;
        struct trial_answer answer;
        trial_measured(&skins, &spectra, i, &measured);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_run(&ready, &measured, &answer));
        TEST_ASSERT_EQUAL_size_t(evaluations_of_plan(wanted, &measured), answer.evaluations);
    }
    trial_ready_done(&ready);
}

static void test_values_alone(void)
{
    compare(false, SCENE_REFINED);
}

/* An interval is looked for along chi-square, and then another solution. */
static void test_intervals(void)
{
    compare(true, SCENE_REFINED | SCENE_INTERVAL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_values_alone);
    RUN_TEST(test_intervals);
    return UNITY_END();
}
