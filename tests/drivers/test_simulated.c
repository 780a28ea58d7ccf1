/* test_simulated.c - the simulated instrument: what it measures, how it lives, and
 * every way in which it fails on demand. */
#include "drivers/simulated/simulated.h"

#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "drivers/call.h"
#include "optics/half_space.h"
#include "optics/two_layer.h"
#include "tests/support/figures.h"
#include "tests/support/folder.h"
#include "tests/support/patience.h"
#include "unity.h"

/* Reply timeout of the tests, and what a busy machine may add to any wait. */
enum { REPLY_MS = 100 };

/* Apertures and grids by index, as simulated.h has them. */
enum { PORT_8MM, PORT_3MM };
enum { GRID_400_700, GRID_360_740 };

/* Nothing by chance: what the instrument sends is what simulated.h says, rounded. */
#define EXACT "simulated:speed=instant,noise=0,placement=0,unit=0,"

static const struct driver *const sim = &simulated_driver;
static struct instrument *instrument;
static struct driver_identity identity;
static struct driver_status status;
static struct driver_reading reading, other;
static struct driver_error error;
static char folder[FOLDER_PATH_SIZE];

void setUp(void)
{
    instrument = NULL;
    memset(&error, 0, sizeof error);
    TEST_ASSERT_TRUE(folder_make(folder));
}

void tearDown(void)
{
    sim->close(instrument);
    instrument = NULL;
    folder_remove(folder);
}

/* ---- helpers ----------------------------------------------------------------------------- */

static enum driver_result try_open(const char *address)
{
    struct driver_options options = { .address = address, .reply_timeout_ms = REPLY_MS };
    options.open_timeout_ms = REPLY_MS;
    sim->close(instrument);
    instrument = NULL;
    return sim->open(&options, &instrument, &identity, &error);
}

static void open_it(const char *address)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, try_open(address), error.text);
}

static void configure_it(size_t grid, size_t aperture)
{
    struct driver_setup setup = { .grid = grid, .aperture = aperture };
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, sim->configure(instrument, &setup, &error));
}

static enum driver_result calibrate(enum driver_calibration step)
{
    return sim->calibrate(instrument, step, &error);
}

static void calibrate_it(void)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, calibrate(DRIVER_CALIBRATION_ZERO), error.text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, calibrate(DRIVER_CALIBRATION_WHITE), error.text);
}

static enum driver_result measure(void)
{
    return sim->measure(instrument, &reading, &error);
}

static void measure_it(void)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, measure(), error.text);
}

static void open_calibrated(const char *address)
{
    open_it(address);
    calibrate_it();
}

static const struct driver_status *ask_status(void)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, sim->status(instrument, &status, &error), error.text);
    return &status;
}

static void check_due(bool zero, bool white)
{
    ask_status();
    TEST_ASSERT_EQUAL_INT(zero, status.due[DRIVER_CALIBRATION_ZERO]);
    TEST_ASSERT_EQUAL_INT(white, status.due[DRIVER_CALIBRATION_WHITE]);
}

static void sleep_ms(long ms)
{
    nanosleep(&(struct timespec){ .tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000 }, NULL);
}

/* ---- what it measures ---------------------------------------------------------------------- */

static void check_counts(const double *expect, const int32_t *raw, size_t n, const char *what)
{
    for (size_t i = 0; i < n; i++) {
        char message[96];
        snprintf(message, sizeof message, "%.40s, band %zu", what, i);
        TEST_ASSERT_EQUAL_INT_MESSAGE((int)nearbyint(expect[i] / 1e-4), raw[i], message);
    }
}

/* expect: the model's own function on the tissue's own medium; the surface by the
 * formula in skin.h: a term in 1/nm^2 that is 5 % at 550 nm */
static const struct skin_case {
    const char *what, *options;
    enum status (*model)(const struct medium *m, double *R);
    double Cm, Bm, Ch, epidermis_mm, surface;
} skin_cases[] = {
    { "as it comes", "", two_layer_reflectance, 0.03, 0.7, 0.01, 0.08, 0.04 },
    { "half space", "model=half-space", half_space_reflectance, 0.03, 0.7, 0.01, 0.08, 0.04 },
    { "dark", "cm=0.3,bm=0.9,ch=0.05", two_layer_reflectance, 0.3, 0.9, 0.05, 0.08, 0.04 },
    { "thick", "epidermis_mm=0.2", two_layer_reflectance, 0.03, 0.7, 0.01, 0.2, 0.04 },
    { "no pigment, no blood", "cm=0,ch=0", two_layer_reflectance, 0, 0.7, 0, 0.08, 0.04 },
    { "matt", "surface=0", two_layer_reflectance, 0.03, 0.7, 0.01, 0.08, 0 },
    { "glossy", "surface=0.1", two_layer_reflectance, 0.03, 0.7, 0.01, 0.08, 0.1 },
};

static void model_spectrum(const struct skin_case *c, size_t grid, double *sce, double *sci)
{
    static struct chromophores chromophores;
    const struct driver_grid *g = &identity.grid[grid];
    struct tissue tissue = tissue_of(c->Cm, c->Bm, c->Ch);
    struct medium medium;
    double scratch[MEDIUM_SCRATCH(64)];
    tissue.epidermis_mm = c->epidermis_mm;
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          chromophores_init(g->first_nm, g->step_nm, g->n, &chromophores));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&tissue, &chromophores, scratch, &medium));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, c->model(&medium, sce));
    for (size_t i = 0; i < g->n; i++) {
        double nm = g->first_nm + (double)i * g->step_nm;
        sci[i] = sce[i] + c->surface * (0.95 + 0.05 * 550.0 * 550.0 / (nm * nm));
    }
}

static void test_skin_is_the_models(void)
{
    for (size_t i = 0; i < sizeof skin_cases / sizeof *skin_cases; i++) {
        const struct skin_case *c = &skin_cases[i];
        char address[256];
        snprintf(address, sizeof address, EXACT "%s", c->options);
        open_calibrated(address);
        for (size_t grid = GRID_400_700; grid <= GRID_360_740; grid++) {
            double sce[64], sci[64];
            configure_it(grid, PORT_8MM);
            model_spectrum(c, grid, sce, sci);
            measure_it();
            TEST_ASSERT_EQUAL_size_t(grid == GRID_400_700 ? 31 : 39, reading.sce.n);
            TEST_ASSERT_EQUAL_DOUBLE(grid == GRID_400_700 ? 400 : 360, reading.sce.first_nm);
            check_counts(sce, reading.raw_sce, reading.sce.n, c->what);
            check_counts(sci, reading.raw_sci, reading.sci.n, c->what);
        }
    }
}

/* expect: none at 400 nm, 10 % at 700 nm (what 5 and 11 mm were found to differ by),
 * straight between and level beyond */
static const struct port_case {
    double nm, share;
} port_cases[] = {
    { 360, 1.0 }, { 400, 1.0 }, { 460, 0.98 }, { 550, 0.95 }, { 700, 0.9 }, { 740, 0.9 },
};

static void test_small_port_loses_red_light(void)
{
    open_calibrated(EXACT "cm=0.01");
    configure_it(GRID_360_740, PORT_8MM);
    measure_it();
    other = reading;
    configure_it(GRID_360_740, PORT_3MM);
    check_due(true, true);
    calibrate_it();
    measure_it();
    TEST_ASSERT_EQUAL_DOUBLE(3.0, reading.sce.aperture_mm);
    TEST_ASSERT_EQUAL_DOUBLE(3.0, reading.sci.aperture_mm);
    for (size_t k = 0; k < sizeof port_cases / sizeof *port_cases; k++) {
        size_t i = spectrum_band(&reading.sce, port_cases[k].nm);
        double large = other.sce.value[i];
        TEST_ASSERT_DOUBLE_WITHIN(1.01e-4, large * port_cases[k].share, reading.sce.value[i]);
        /* The surface knows nothing of the port. */
        TEST_ASSERT_DOUBLE_WITHIN(2.01e-4, other.sci.value[i] - large,
                                  reading.sci.value[i] - reading.sce.value[i]);
    }
}

/* expect: blood falls evenly to the stated share at the last replicate, then anew */
static void test_pressure_blanches(void)
{
    static const double blood[] = { 0.02, 0.015, 0.01, 0.02, 0.015 };
    open_calibrated(EXACT "ch=0.02,replicates=3,pressure=0.5");
    for (size_t shot = 0; shot < sizeof blood / sizeof *blood; shot++) {
        struct skin_case c = skin_cases[0];
        double sce[64], sci[64];
        c.Ch = blood[shot];
        model_spectrum(&c, GRID_400_700, sce, sci);
        measure_it();
        check_counts(sce, reading.raw_sce, reading.sce.n, "pressed");
    }
}

static void test_replicates_without_pressure_are_alike(void)
{
    open_calibrated(EXACT "replicates=3");
    measure_it();
    other = reading;
    for (int i = 0; i < 4; i++) {
        measure_it();
        TEST_ASSERT_EQUAL_MEMORY(other.raw_sce, reading.raw_sce, sizeof reading.raw_sce);
    }
}

/* ---- chance -------------------------------------------------------------------------------- */

enum { SHOTS = 2000, BANDS = 31 };
static double shots[SHOTS][BANDS];
static double mean[BANDS], sd[BANDS];

static void take_shots(const char *address, bool sci)
{
    open_calibrated(address);
    memset(mean, 0, sizeof mean);
    memset(sd, 0, sizeof sd);
    for (size_t k = 0; k < SHOTS; k++) {
        measure_it();
        for (size_t i = 0; i < BANDS; i++) {
            shots[k][i] = sci ? reading.sci.value[i] : reading.sce.value[i];
            mean[i] += shots[k][i] / SHOTS;
        }
    }
    for (size_t k = 0; k < SHOTS; k++)
        for (size_t i = 0; i < BANDS; i++)
            sd[i] += (shots[k][i] - mean[i]) * (shots[k][i] - mean[i]) / (SHOTS - 1);
    for (size_t i = 0; i < BANDS; i++)
        sd[i] = sqrt(sd[i]);
}

static double correlation(size_t i, size_t k)
{
    double sum = 0.0;
    for (size_t n = 0; n < SHOTS; n++)
        sum += (shots[n][i] - mean[i]) * (shots[n][k] - mean[k]);
    return sum / ((SHOTS - 1) * sd[i] * sd[k]);
}

/* 5 standard errors: of a mean sd/sqrt(n), of an sd sd/sqrt(2n), of a correlation of
 * nothing 1/sqrt(n).  Rounding to counts adds (1e-4)^2/12 to the variance. */
#define FIVE_ERRORS (5.0 / 44.721359549995796)
#define ROUNDING_VARIANCE (1e-8 / 12.0)

static void check_white_noise(bool sci)
{
    struct skin_case c = skin_cases[0];
    double spectrum[2][64], expect_sd = sqrt(0.002 * 0.002 + ROUNDING_VARIANCE);
    take_shots("speed=instant,seed=11,noise=0.002,placement=0,unit=0,drain=0,"
               "calibration_shots=1000000",
               sci);
    model_spectrum(&c, GRID_400_700, spectrum[0], spectrum[1]);
    for (size_t i = 0; i < BANDS; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(FIVE_ERRORS * expect_sd, spectrum[sci][i], mean[i]);
        TEST_ASSERT_DOUBLE_WITHIN(FIVE_ERRORS * expect_sd / sqrt(2.0), expect_sd, sd[i]);
        if (i > 0)
            TEST_ASSERT_DOUBLE_WITHIN(FIVE_ERRORS, 0.0, correlation(i, i - 1));
    }
}

static void test_noise_per_band(void)
{
    check_white_noise(false);
    check_white_noise(true);
}

static void test_placement_is_one_factor_per_shot(void)
{
    struct skin_case c = skin_cases[0];
    double sce[64], sci[64];
    take_shots("speed=instant,seed=11,noise=0,placement=0.02,unit=0,drain=0,"
               "calibration_shots=1000000",
               false);
    model_spectrum(&c, GRID_400_700, sce, sci);
    for (size_t i = 0; i < BANDS; i++) {
        double expect_sd = sqrt(0.02 * 0.02 * sce[i] * sce[i] + ROUNDING_VARIANCE);
        TEST_ASSERT_DOUBLE_WITHIN(FIVE_ERRORS * expect_sd, sce[i], mean[i]);
        TEST_ASSERT_DOUBLE_WITHIN(FIVE_ERRORS * expect_sd / sqrt(2.0), expect_sd, sd[i]);
        TEST_ASSERT_TRUE(correlation(i, BANDS - 1) > 0.999);
    }
}

/* As it comes, light skin in the red repeats as MODEL figures have it: sd 0.007..0.009. */
static void test_default_noise_is_that_of_skin(void)
{
    take_shots("speed=instant,cm=0.01,drain=0,calibration_shots=1000000", false);
    TEST_ASSERT_TRUE(mean[BANDS - 1] > 0.4 && mean[BANDS - 1] < 0.6);
    double scaled = sd[BANDS - 1] * 0.4 / mean[BANDS - 1];
    TEST_ASSERT_TRUE(scaled > 0.007 && scaled < 0.009);
}

/* Property: the seed decides, and a shot's numbers do not depend on others'. */
static void test_seed(void)
{
    open_calibrated("speed=instant,seed=1");
    measure_it();
    measure_it();
    other = reading;
    open_calibrated("speed=instant,seed=1,fault=measure:1:garbage");
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, measure()); /* it did not flash */
    measure_it();
    TEST_ASSERT_NOT_EQUAL(0, memcmp(other.raw_sce, reading.raw_sce, sizeof reading.raw_sce));
    measure_it();
    TEST_ASSERT_EQUAL_MEMORY(other.raw_sce, reading.raw_sce, sizeof reading.raw_sce);
    open_calibrated("speed=instant,seed=2");
    measure_it();
    measure_it();
    TEST_ASSERT_NOT_EQUAL(0, memcmp(other.raw_sce, reading.raw_sce, sizeof reading.raw_sce));
}

/* What makes units differ: a level, normal with the stated sd, seen alone at 550 nm. */
static void test_units_differ_by_their_serial_number(void)
{
    enum { UNITS = 400 };
    double sum = 0.0, squares = 0.0, level[2] = { 0.0, 0.0 };
    size_t at_550 = 15;
    struct skin_case c = skin_cases[0];
    double sce[64], sci[64];
    for (int k = 0; k < UNITS; k++) {
        char address[128];
        snprintf(address, sizeof address,
                 "speed=instant,noise=0,placement=0,unit=0.1,serial=unit %d", k);
        open_calibrated(address);
        TEST_ASSERT_EQUAL_STRING(strstr(address, "serial=") + 7, identity.serial);
        measure_it();
        if (k == 0)
            model_spectrum(&c, GRID_400_700, sce, sci);
        double x = reading.sce.value[at_550] / sce[at_550] - 1.0;
        sum += x;
        squares += x * x;
        if (k < 2)
            level[k] = x;
    }
    double average = sum / UNITS, spread = sqrt(squares / UNITS - average * average);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * 0.1 / sqrt(UNITS), 0.0, average);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * 0.1 / sqrt(2.0 * UNITS), 0.1, spread);
    TEST_ASSERT_TRUE(level[0] != level[1]);
}

/* Each shot since the calibration adds its share, and a calibration begins anew. */
static void test_drift(void)
{
    open_calibrated("speed=instant,noise=0,placement=0,unit=0,drift=0.05,overdue=warn");
    measure_it();
    struct driver_reading first = reading;
    for (int after = 1; after <= 3; after++) {
        measure_it();
        for (size_t i = 0; i < reading.sce.n; i++)
            TEST_ASSERT_DOUBLE_WITHIN(1.2e-4, first.sce.value[i] * (1.0 + 0.05 * after),
                                      reading.sce.value[i]);
    }
    calibrate_it();
    measure_it();
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(first.sce.value, reading.sce.value, reading.sce.n);
}

/* ---- played spectra -------------------------------------------------------------------------- */

static void test_plays_the_example_row_by_row(void)
{
    struct figures f;
    TEST_ASSERT_TRUE(figures_read("docs/examples/skin.csv", &f));
    size_t first = figures_column(&f, "400");
    open_calibrated(EXACT "spectra=docs/examples/skin.csv,replicates=2");
    for (size_t shot = 0; shot < 2 * f.rows + 3; shot++) { /* and from the start again */
        double expect[BANDS];
        for (size_t i = 0; i < BANDS; i++)
            expect[i] = figures_at(&f, shot / 2 % f.rows, first + i);
        measure_it();
        check_counts(expect, reading.raw_sce, BANDS, "example");
    }
    figures_done(&f);
}

static const char *write_file(const char *text)
{
    static char path[FOLDER_PATH_SIZE];
    TEST_ASSERT_TRUE(file_write(folder_path(folder, "s.csv", path), text, strlen(text)));
    return path;
}

static enum driver_result try_play(const char *path)
{
    char address[FOLDER_PATH_SIZE + 128];
    snprintf(address, sizeof address, EXACT "spectra=%s", path);
    return try_open(address);
}

/* expect: by hand; the file's 0.2 at 450 nm rises to 0.4 at 650 nm */
static void test_plays_between_and_beyond_the_files_bands(void)
{
    static const struct {
        double nm, R;
    } expect[] = { { 360, 0.2 },  { 450, 0.2 }, { 460, 0.21 }, { 550, 0.3 },
                   { 640, 0.39 }, { 650, 0.4 }, { 740, 0.4 } };
    const char *path = write_file("# made up\r\n\r\nname,450,Specular,specular,550,650\r\n"
                                  "a,0.2,,SCE,0.3,0.4\r\n");
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, try_play(path), error.text);
    configure_it(GRID_360_740, PORT_8MM);
    calibrate_it();
    measure_it();
    for (size_t k = 0; k < sizeof expect / sizeof *expect; k++) {
        size_t i = spectrum_band(&reading.sce, expect[k].nm);
        TEST_ASSERT_EQUAL_INT((int)nearbyint(expect[k].R / 1e-4), reading.raw_sce[i]);
    }
}

static void test_plays_long_files(void)
{
    static char text[4096] = "400,700\n";
    for (int row = 1; row <= 40; row++) {
        size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "%.2f,%.2f\n", 0.01 * row, 0.01 * row);
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, try_play(write_file(text)), error.text);
    calibrate_it();
    for (int row = 1; row <= 40; row++) {
        measure_it();
        TEST_ASSERT_EQUAL_INT(100 * row, reading.raw_sce[0]);
    }
}

static const struct bad_file_case {
    const char *what, *text, *said;
} bad_file_cases[] = {
    { "empty", "", "s.csv:0: no header" },
    { "comments only", "# a\n#b\n", "no header" },
    { "no wavelengths", "id,specular\na,sce\n", "s.csv:1: needs wavelengths" },
    { "one wavelength", "id,400\na,0.1\n", "needs wavelengths" },
    { "falling", "500,400\n0.1,0.1\n", "s.csv:1: wavelengths must rise" },
    { "twice the same", "500,500\n0.1,0.1\n", "must rise" },
    { "no spectra", "400,500\n", "no spectra" },
    { "specular included", "specular,400,500\nsci,0.1,0.1\n", "s.csv:2: specular must be sce" },
    { "no number", "400,500\n0.1,x\n", "from 0 to 1" },
    { "percent", "400,500\n\n10,20\n", "s.csv:3: reflectance must be a number from 0 to 1" },
    { "negative", "400,500\n0.1,-0.1\n", "from 0 to 1" },
    { "not measured", "400,500\n0.1,\n", "from 0 to 1" },
    { "a field too few", "400,500\n0.1\n", "fewer fields" },
    { "a field too many", "400,500\n0.1,0.1,0.1\n", "more fields" },
};

static void test_files_refused(void)
{
    for (size_t i = 0; i < sizeof bad_file_cases / sizeof *bad_file_cases; i++) {
        const struct bad_file_case *c = &bad_file_cases[i];
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_UNSUPPORTED, try_play(write_file(c->text)), c->what);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, c->said), error.text);
    }
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, try_play("/nowhere/at all.csv"));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "No such file"), error.text);
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, try_play(folder));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "Is a directory"), error.text);
}

static void test_files_too_large(void)
{
    char path[FOLDER_PATH_SIZE];
    FILE *f = fopen(folder_path(folder, "columns.csv", path), "w");
    TEST_ASSERT_NOT_NULL(f);
    for (int i = 0; i < 1025; i++)
        fprintf(f, "%d,", i);
    TEST_ASSERT_EQUAL_INT(0, fclose(f));
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, try_play(path));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "more than 1024 columns"), error.text);

    f = fopen(folder_path(folder, "rows.csv", path), "w");
    TEST_ASSERT_NOT_NULL(f);
    fprintf(f, "400,700\n");
    for (int i = 0; i < 100001; i++)
        fprintf(f, "0.1,0.1\n");
    TEST_ASSERT_EQUAL_INT(0, fclose(f));
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, try_play(path));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "more than 100000 spectra"), error.text);
}

/* ---- calibration -------------------------------------------------------------------- */

static void test_white_is_due_after_some_shots(void)
{
    open_calibrated("speed=instant,calibration_shots=3");
    for (int i = 0; i < 3; i++) {
        check_due(false, false);
        measure_it();
    }
    check_due(false, true);
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, measure());
    TEST_ASSERT_EQUAL_STRING("ER24", error.code);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "white tile"), error.text);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, calibrate(DRIVER_CALIBRATION_WHITE));
    measure_it();
}

static void test_white_is_due_after_some_time(void)
{
    open_calibrated("speed=instant,calibration_minutes=0.005"); /* 300 ms */
    measure_it();
    check_due(false, false);
    sleep_ms(310);
    check_due(false, true);
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, measure());
}

static void test_overdue_may_be_a_warning(void)
{
    open_it("speed=instant,calibration_shots=1,overdue=warn");
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, measure()); /* never done: no choice */
    TEST_ASSERT_EQUAL_STRING("ER07", error.code);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "zero box"), error.text);
    calibrate_it();
    measure_it();
    TEST_ASSERT_EQUAL_UINT(0, reading.warnings & ~(unsigned)DRIVER_WARNING_CALIBRATION_OLD);
    measure_it();
    TEST_ASSERT_EQUAL_UINT(DRIVER_WARNING_CALIBRATION_OLD, reading.warnings);
    check_due(false, true);
}

static void test_what_makes_calibrations_due(void)
{
    open_calibrated("speed=instant");
    configure_it(GRID_360_740, PORT_8MM); /* the sensor sees all bands anyway */
    check_due(false, false);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, calibrate(DRIVER_CALIBRATION_ZERO));
    check_due(false, true); /* white was seen with another zero */
    calibrate_it();
    configure_it(GRID_360_740, PORT_3MM);
    check_due(true, true);
    calibrate_it();
    configure_it(GRID_400_700, PORT_3MM);
    check_due(false, false);
}

/* ---- flash, battery, temperature ------------------------------------------------------------- */

/* expect: the stated times, over the speed; no longer than a busy machine adds */
static const struct time_case {
    const char *what, *options;
    int first_ms, second_ms; /* of two shots, one after the other */
} time_cases[] = {
    { "no time", "speed=instant", 0, 0 },
    { "a shot", "shot_ms=150,charge_ms=0,calibrate_ms=0", 150, 150 },
    { "then the flash charges", "shot_ms=20,charge_ms=200,calibrate_ms=0", 20, 220 },
    { "ten times as fast", "speed=10,shot_ms=1000,charge_ms=2000,calibrate_ms=0", 100, 300 },
    { "half as fast", "speed=0.5,shot_ms=50,charge_ms=50,calibrate_ms=0", 100, 200 },
};

static int64_t time_of_shot_ms(void)
{
    int64_t began_ms = call_now_ms();
    measure_it();
    return call_now_ms() - began_ms;
}

static void test_times(void)
{
    for (size_t i = 0; i < sizeof time_cases / sizeof *time_cases; i++) {
        const struct time_case *c = &time_cases[i];
        open_calibrated(c->options);
        while (ask_status()->charging)
            sleep_ms(5);
        int64_t began_ms = call_now_ms(), first_ms = time_of_shot_ms();
        measure_it();
        int64_t both_ms = call_now_ms() - began_ms, expect_ms = c->first_ms + c->second_ms;
        TEST_ASSERT_TRUE_MESSAGE(first_ms >= c->first_ms && both_ms >= expect_ms, c->what);
        TEST_ASSERT_TRUE_MESSAGE(first_ms <= c->first_ms + SLACK_MS, c->what);
        TEST_ASSERT_TRUE_MESSAGE(both_ms <= expect_ms + SLACK_MS, c->what);
    }
}

static void test_status_tells_of_charging(void)
{
    open_it("shot_ms=0,calibrate_ms=0,charge_ms=300");
    TEST_ASSERT_FALSE(ask_status()->charging);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, calibrate(DRIVER_CALIBRATION_ZERO));
    TEST_ASSERT_TRUE(ask_status()->charging);
    sleep_ms(310);
    TEST_ASSERT_FALSE(ask_status()->charging);
}

/* expect: two calibrations leave 19 %: low from the first shot; 15 shots leave 4 % */
static void test_battery_drains_warns_and_refuses(void)
{
    open_calibrated("speed=instant,battery=21,drain=1");
    for (int left = 18; left >= 4; left--) {
        measure_it();
        TEST_ASSERT_EQUAL_UINT(DRIVER_WARNING_BATTERY_LOW, reading.warnings);
        TEST_ASSERT_EQUAL_INT(left, ask_status()->battery_percent);
    }
    TEST_ASSERT_EQUAL_INT(DRIVER_BATTERY, measure());
    TEST_ASSERT_EQUAL_STRING("ER02", error.code);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "charge"), error.text);
    TEST_ASSERT_EQUAL_INT(DRIVER_BATTERY, calibrate(DRIVER_CALIBRATION_ZERO));
    TEST_ASSERT_EQUAL_INT(4, ask_status()->battery_percent); /* it still answers */
}

static void test_battery_ends_at_nothing(void)
{
    open_it("speed=instant,battery=6,drain=50");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, calibrate(DRIVER_CALIBRATION_ZERO));
    TEST_ASSERT_EQUAL_INT(0, ask_status()->battery_percent);
}

/* expect: simulated.h: trusted from 10 to 40 */
static void test_temperature(void)
{
    static const struct {
        const char *options;
        double C;
        unsigned warnings;
    } cases[] = {
        { "speed=instant", 24, 0 },
        { "speed=instant,temperature=10", 10, 0 },
        { "speed=instant,temperature=40", 40, 0 },
        { "speed=instant,temperature=9.9", 9.9, DRIVER_WARNING_TEMPERATURE },
        { "speed=instant,temperature=40.1", 40.1, DRIVER_WARNING_TEMPERATURE },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        open_calibrated(cases[i].options);
        measure_it();
        TEST_ASSERT_EQUAL_UINT_MESSAGE(cases[i].warnings, reading.warnings, cases[i].options);
        TEST_ASSERT_EQUAL_DOUBLE(cases[i].C, ask_status()->temperature_C);
    }
}

/* ---- stored samples
 * ------------------------------------------------------------------------------ */

static enum driver_result read_sample(size_t i)
{
    return sim->stored_read(instrument, i, &reading, &error);
}

static void test_stored_samples(void)
{
    size_t n = 77;
    open_it("speed=instant,stored=3");
    configure_it(GRID_360_740, PORT_8MM);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, read_sample(2));
    other = reading;
    configure_it(GRID_360_740, PORT_3MM); /* samples keep the port they were taken through */
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, sim->stored_count(instrument, &n, &error));
    TEST_ASSERT_EQUAL_size_t(3, n);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, read_sample(2));
    TEST_ASSERT_EQUAL_STRING("S0003", reading.sample);
    TEST_ASSERT_EQUAL_DOUBLE(8.0, reading.sce.aperture_mm);
    TEST_ASSERT_EQUAL_size_t(39, reading.sce.n);
    TEST_ASSERT_EQUAL_MEMORY(&other, &reading, sizeof reading);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, read_sample(0));
    TEST_ASSERT_EQUAL_STRING("S0001", reading.sample);
    TEST_ASSERT_NOT_EQUAL(0, memcmp(other.raw_sce, reading.raw_sce, sizeof reading.raw_sce));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, read_sample(2)); /* the same whenever it is read */
    TEST_ASSERT_EQUAL_MEMORY(&other, &reading, sizeof reading);
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, read_sample(3));
    TEST_ASSERT_EQUAL_STRING("ER10", error.code);
}

static void test_empty_memory(void)
{
    size_t n = 77;
    open_it("speed=instant");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, sim->stored_count(instrument, &n, &error));
    TEST_ASSERT_EQUAL_size_t(0, n);
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, read_sample(0));
}

/* ---- the button
 * ------------------------------------------------------------------------------------ */

static bool pressed_within(int timeout_ms)
{
    bool pressed = false;
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        DRIVER_OK, sim->wait_button(instrument, timeout_ms, &pressed, &error), error.text);
    return pressed;
}

static void open_with_button_file(const char *path)
{
    char address[FOLDER_PATH_SIZE + 64];
    snprintf(address, sizeof address, "speed=instant,button_file=%s", path);
    open_it(address);
}

static void touch(const char *path)
{
    int fd = open(path, O_WRONLY | O_CREAT, 0600);
    TEST_ASSERT_TRUE(fd >= 0);
    TEST_ASSERT_EQUAL_INT(0, futimens(fd, NULL));
    close(fd);
    sleep_ms(20); /* files' times move in steps of the kernel's clock */
}

static void test_button_by_schedule(void)
{
    open_it("speed=10,button_ms=2000"); /* every 200 ms */
    TEST_ASSERT_FALSE(pressed_within(0));
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_TRUE(pressed_within(5000));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms <= 200 + SLACK_MS);
    TEST_ASSERT_TRUE(pressed_within(5000));
    sleep_ms(500); /* two presses or three, unheard: one */
    TEST_ASSERT_TRUE(pressed_within(0));
    TEST_ASSERT_FALSE(pressed_within(0));
    open_it("speed=instant,button_ms=2000");
    sleep_ms(5);
    TEST_ASSERT_TRUE(pressed_within(10));
}

static void test_button_by_touching_a_file(void)
{
    char path[FOLDER_PATH_SIZE];
    open_with_button_file(folder_path(folder, "press", path));
    TEST_ASSERT_FALSE(pressed_within(30));
    touch(path); /* made */
    TEST_ASSERT_TRUE(pressed_within(0));
    TEST_ASSERT_FALSE(pressed_within(30));
    touch(path); /* touched twice: one press */
    touch(path);
    TEST_ASSERT_TRUE(pressed_within(0));
    TEST_ASSERT_FALSE(pressed_within(0));
    TEST_ASSERT_EQUAL_INT(0, unlink(path)); /* no press */
    TEST_ASSERT_FALSE(pressed_within(30));
    touch(path);
    TEST_ASSERT_TRUE(pressed_within(0));
    TEST_ASSERT_TRUE(file_write(path, "!", 1)); /* written to */
    TEST_ASSERT_TRUE(pressed_within(0));
}

static void *press_fifo_soon(void *path)
{
    sleep_ms(60);
    int fd = open(path, O_WRONLY | O_NONBLOCK);
    if (fd >= 0) {
        (void)!write(fd, "xxx", 3);
        close(fd);
    }
    return NULL;
}

static void test_button_by_fifo(void)
{
    char path[FOLDER_PATH_SIZE];
    pthread_t thread;
    TEST_ASSERT_EQUAL_INT(0, mkfifo(folder_path(folder, "press", path), 0600));
    open_with_button_file(path);
    TEST_ASSERT_FALSE(pressed_within(0));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, press_fifo_soon, path));
    int64_t began_ms = call_now_ms();
    bool pressed = pressed_within(5000);
    int64_t took_ms = call_now_ms() - began_ms;
    pthread_join(thread, NULL);
    TEST_ASSERT_TRUE(pressed && took_ms <= 60 + SLACK_MS);
    TEST_ASSERT_FALSE(pressed_within(30)); /* three bytes at once: one press */
    (void)press_fifo_soon(path);
    TEST_ASSERT_TRUE(pressed_within(0)); /* before the call: counts */
}

static void test_button_by_all_together(void)
{
    char address[FOLDER_PATH_SIZE + 64], path[FOLDER_PATH_SIZE];
    folder_path(folder, "press", path);
    snprintf(address, sizeof address, "button_ms=100,button_file=%s", path);
    open_it(address);
    TEST_ASSERT_TRUE(pressed_within(1000));
    touch(path);
    TEST_ASSERT_TRUE(pressed_within(0));
}

/* ---- what goes wrong
 * -------------------------------------------------------------------------------- */

static enum driver_result do_configure(void)
{
    return sim->configure(
        instrument, &(struct driver_setup){ .grid = GRID_360_740, .aperture = PORT_8MM }, &error);
}

static enum driver_result do_status(void)
{
    return sim->status(instrument, &status, &error);
}

static enum driver_result do_zero(void)
{
    return calibrate(DRIVER_CALIBRATION_ZERO);
}

static enum driver_result do_wait_button(void)
{
    bool pressed;
    return sim->wait_button(instrument, 0, &pressed, &error);
}

static enum driver_result do_stored_count(void)
{
    size_t n;
    return sim->stored_count(instrument, &n, &error);
}

static enum driver_result do_stored_read(void)
{
    return read_sample(0);
}

/* The calls that meet a fault; each is made when all is calibrated and charged. */
static const struct doing {
    const char *name;
    enum driver_result (*call)(void);
    int before; /* calls of the same operation that the preparation has made */
} doings[] = {
    { "configure", do_configure, 0 },     { "status", do_status, 0 },
    { "calibrate", do_zero, 2 },          { "measure", measure, 0 },
    { "wait_button", do_wait_button, 0 }, { "stored_count", do_stored_count, 0 },
    { "stored_read", do_stored_read, 0 },
};

/* expect: the table of faults in simulated.h */
static const struct fault_case {
    const char *kind, *only; /* NULL: at any operation */
    enum driver_result expect;
    const char *code, *said;
    enum driver_result then; /* the next call of the same kind */
} fault_cases[] = {
    { "silence", NULL, DRIVER_TIMEOUT, "", "no answer in 100 ms", DRIVER_OK },
    { "slow", NULL, DRIVER_OK, "", "", DRIVER_OK },
    { "gone", NULL, DRIVER_GONE, "", "connect it", DRIVER_GONE },
    { "garbage", NULL, DRIVER_PROTOCOL, "", "right driver", DRIVER_OK },
    { "swapped", "calibrate", DRIVER_IMPLAUSIBLE, "ER11", "swapped?", DRIVER_OK },
    { "lamp", "calibrate", DRIVER_FAULT, "ER05", "did not flash", DRIVER_OK },
    { "lamp", "measure", DRIVER_FAULT, "ER05", "did not flash", DRIVER_OK },
    { "battery", "calibrate", DRIVER_BATTERY, "ER02", "charge it", DRIVER_BATTERY },
    { "battery", "measure", DRIVER_BATTERY, "ER02", "charge it", DRIVER_BATTERY },
    { "charge", "measure", DRIVER_BUSY, "ER28", "flash", DRIVER_OK },
    { "weak_lamp", "measure", DRIVER_OK, "", "", DRIVER_OK },
    { "expired", "measure", DRIVER_REFUSED, "ER24", "white tile", DRIVER_REFUSED },
    { "wrong_bands", "measure", DRIVER_PROTOCOL, "", "30 bands came instead of 31", DRIVER_OK },
    { "wrong_bands", "stored_read", DRIVER_PROTOCOL, "", "30 bands", DRIVER_OK },
    { "nan", "measure", DRIVER_IMPLAUSIBLE, "", "band 16 is no reflectance", DRIVER_OK },
    { "nan", "stored_read", DRIVER_IMPLAUSIBLE, "", "no reflectance", DRIVER_OK },
    { "all_zero", "measure", DRIVER_IMPLAUSIBLE, "", "no light", DRIVER_OK },
    { "all_zero", "stored_read", DRIVER_IMPLAUSIBLE, "", "no light", DRIVER_OK },
};

static void check_fault(const struct fault_case *c, const struct doing *d)
{
    char address[128], message[64];
    snprintf(message, sizeof message, "%s at %s", c->kind, d->name);
    snprintf(address, sizeof address, "speed=instant,stored=1,fault=%s:%d:%s", d->name,
             d->before + 1, c->kind);
    open_calibrated(address);
    memset(&reading, 0x77, sizeof reading);
    other = reading;
    memset(&error, 0, sizeof error);

    TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, d->call(), message);
    if (c->expect != DRIVER_OK) {
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, error.result, message);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&other, &reading, sizeof reading, message);
    }
    TEST_ASSERT_EQUAL_STRING_MESSAGE(c->code, error.code, message);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, c->said), error.text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(c->then, d->call(), message);
}

static void test_faults(void)
{
    for (size_t i = 0; i < sizeof fault_cases / sizeof *fault_cases; i++)
        for (size_t k = 0; k < sizeof doings / sizeof *doings; k++)
            if (fault_cases[i].only == NULL || strcmp(fault_cases[i].only, doings[k].name) == 0)
                check_fault(&fault_cases[i], &doings[k]);
}

/* expect: the table of faults in simulated.h */
static void test_faults_at_opening(void)
{
    static const struct {
        const char *kind, *said;
        enum driver_result expect;
    } cases[] = {
        { "silence", "no answer", DRIVER_TIMEOUT },
        { "gone", "connect it", DRIVER_GONE },
        { "garbage", "right driver", DRIVER_PROTOCOL },
        { "busy", "another program", DRIVER_BUSY },
        { "no_permission", "no permission", DRIVER_NO_PERMISSION },
        { "slow", "", DRIVER_OK },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char address[64];
        snprintf(address, sizeof address, "speed=instant,fault=open:1:%s", cases[i].kind);
        TEST_ASSERT_EQUAL_INT_MESSAGE(cases[i].expect, try_open(address), cases[i].kind);
        if (cases[i].expect == DRIVER_OK)
            continue;
        TEST_ASSERT_EQUAL_INT_MESSAGE(cases[i].expect, error.result, cases[i].kind);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, cases[i].said), error.text);
    }
}

static void test_every_call_from_some_on(void)
{
    open_calibrated("speed=instant,fault=measure:2+:nan");
    measure_it();
    for (int i = 0; i < 3; i++)
        TEST_ASSERT_EQUAL_INT(DRIVER_IMPLAUSIBLE, measure());
}

/* Slow within the timeout is late, beyond it nothing came. */
static void test_slow_answers(void)
{
    open_calibrated("shot_ms=20,charge_ms=0,calibrate_ms=0,slow_ms=60,fault=measure:1:slow");
    int64_t took_ms = time_of_shot_ms();
    TEST_ASSERT_TRUE(took_ms >= 80 && took_ms <= 80 + SLACK_MS);
    open_calibrated("shot_ms=20,charge_ms=0,calibrate_ms=0,slow_ms=180,fault=measure:1:slow");
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, measure());
    measure_it(); /* the late answer is not taken for this one's: the seed's second shot */
    other = reading;
    open_calibrated("speed=instant");
    measure_it();
    measure_it();
    TEST_ASSERT_EQUAL_MEMORY(other.raw_sce, reading.raw_sce, sizeof reading.raw_sce);
}

static void test_swapped_leaves_the_step_due(void)
{
    open_it("speed=instant,fault=calibrate:2:swapped");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, calibrate(DRIVER_CALIBRATION_ZERO));
    TEST_ASSERT_EQUAL_INT(DRIVER_IMPLAUSIBLE, calibrate(DRIVER_CALIBRATION_WHITE));
    check_due(false, true);
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, measure());
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, calibrate(DRIVER_CALIBRATION_WHITE));
    measure_it();
}

static void test_expired_leaves_white_due(void)
{
    open_calibrated("speed=instant,fault=measure:1:expired");
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, measure());
    check_due(false, true);
}

static void test_dead_battery_shows(void)
{
    open_calibrated("speed=instant,fault=measure:1:battery");
    TEST_ASSERT_EQUAL_INT(DRIVER_BATTERY, measure());
    TEST_ASSERT_EQUAL_INT(0, ask_status()->battery_percent);
}

static void test_gone_until_opened_again(void)
{
    open_calibrated("speed=instant,stored=1,fault=status:1:gone");
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, do_status());
    for (size_t i = 0; i < sizeof doings / sizeof *doings; i++)
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_GONE, doings[i].call(), doings[i].name);
    open_it("speed=instant");
    check_due(true, true); /* it was off */
}

static void test_lamp_warnings(void)
{
    open_calibrated("speed=instant,fault=measure:1:weak_lamp");
    measure_it();
    TEST_ASSERT_EQUAL_UINT(DRIVER_WARNING_LAMP_WEAK, reading.warnings);
    measure_it();
    TEST_ASSERT_EQUAL_UINT(0, reading.warnings);
    open_calibrated("speed=instant,battery=15,fault=measure:1:weak_lamp");
    measure_it();
    TEST_ASSERT_EQUAL_UINT(DRIVER_WARNING_LAMP_WEAK | DRIVER_WARNING_BATTERY_LOW, reading.warnings);
}

static void *cancel_soon(void *unused)
{
    (void)unused;
    sleep_ms(60);
    sim->cancel(instrument);
    return NULL;
}

/* The flash has a minute to go, and nothing is said about any deadline. */
static void test_cancel_while_charging(void)
{
    pthread_t thread;
    open_it("calibrate_ms=0,charge_ms=60000");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, calibrate(DRIVER_CALIBRATION_ZERO));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_soon, NULL));
    int64_t began_ms = call_now_ms();
    enum driver_result result = calibrate(DRIVER_CALIBRATION_WHITE);
    int64_t took_ms = call_now_ms() - began_ms;
    pthread_join(thread, NULL);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, result);
    TEST_ASSERT_TRUE(took_ms <= 60 + 200);
}

/* ---- opening
 * ------------------------------------------------------------------------------------------ */

static void test_identity(void)
{
    struct driver_options options = { .address = NULL }; /* the driver's own choices */
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, sim->open(&options, &instrument, &identity, &error));
    TEST_ASSERT_EQUAL_STRING("SIM-1", identity.serial);
    TEST_ASSERT_EQUAL_STRING("d/8", driver_geometry_name(identity.geometry));
    TEST_ASSERT_TRUE(identity.has_sci && identity.has_sce && identity.has_button);
    TEST_ASSERT_TRUE(identity.has_battery && identity.has_stored_samples);
    TEST_ASSERT_EQUAL_size_t(2, identity.grids);
    TEST_ASSERT_EQUAL_size_t(2, identity.apertures);
    TEST_ASSERT_EQUAL_DOUBLE(8.0, identity.aperture_mm[PORT_8MM]);
    TEST_ASSERT_EQUAL_DOUBLE(3.0, identity.aperture_mm[PORT_3MM]);
    open_it("serial=");
    TEST_ASSERT_EQUAL_STRING("", identity.serial);
}

static void test_bad_options_are_the_users_to_mend(void)
{
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, try_open("simulated:cm=2"));
    TEST_ASSERT_EQUAL_STRING("simulated: cm=2: allowed is a number from 0 to 1", error.text);
    TEST_ASSERT_NULL(instrument);
}

/* With n descriptors to be had. */
static enum driver_result open_with_descriptors(rlim_t n, const char *address)
{
    struct rlimit before, few;
    int next = dup(0); /* the lowest that is free */
    TEST_ASSERT_TRUE(next >= 0);
    close(next);
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_NOFILE, &before));
    few = before;
    few.rlim_cur = (rlim_t)next + n;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &few));
    enum driver_result result = try_open(address);
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &before));
    return result;
}

static void test_no_descriptor_left(void)
{
    char address[FOLDER_PATH_SIZE + 64], path[FOLDER_PATH_SIZE];
    TEST_ASSERT_EQUAL_INT(0, mkfifo(folder_path(folder, "press", path), 0600));
    snprintf(address, sizeof address, "speed=instant,button_file=%s", path);
    TEST_ASSERT_EQUAL_INT(DRIVER_FAULT, open_with_descriptors(0, address));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "no descriptor"), error.text);
    TEST_ASSERT_EQUAL_INT(DRIVER_FAULT, open_with_descriptors(1, address));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "Too many open files"), error.text);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, open_with_descriptors(2, address));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_skin_is_the_models);
    RUN_TEST(test_small_port_loses_red_light);
    RUN_TEST(test_pressure_blanches);
    RUN_TEST(test_replicates_without_pressure_are_alike);
    RUN_TEST(test_noise_per_band);
    RUN_TEST(test_placement_is_one_factor_per_shot);
    RUN_TEST(test_default_noise_is_that_of_skin);
    RUN_TEST(test_seed);
    RUN_TEST(test_units_differ_by_their_serial_number);
    RUN_TEST(test_drift);
    RUN_TEST(test_plays_the_example_row_by_row);
    RUN_TEST(test_plays_between_and_beyond_the_files_bands);
    RUN_TEST(test_plays_long_files);
    RUN_TEST(test_files_refused);
    RUN_TEST(test_files_too_large);
    RUN_TEST(test_white_is_due_after_some_shots);
    RUN_TEST(test_white_is_due_after_some_time);
    RUN_TEST(test_overdue_may_be_a_warning);
    RUN_TEST(test_what_makes_calibrations_due);
    RUN_TEST(test_times);
    RUN_TEST(test_status_tells_of_charging);
    RUN_TEST(test_battery_drains_warns_and_refuses);
    RUN_TEST(test_battery_ends_at_nothing);
    RUN_TEST(test_temperature);
    RUN_TEST(test_stored_samples);
    RUN_TEST(test_empty_memory);
    RUN_TEST(test_button_by_schedule);
    RUN_TEST(test_button_by_touching_a_file);
    RUN_TEST(test_button_by_fifo);
    RUN_TEST(test_button_by_all_together);
    RUN_TEST(test_faults);
    RUN_TEST(test_faults_at_opening);
    RUN_TEST(test_every_call_from_some_on);
    RUN_TEST(test_slow_answers);
    RUN_TEST(test_swapped_leaves_the_step_due);
    RUN_TEST(test_expired_leaves_white_due);
    RUN_TEST(test_dead_battery_shows);
    RUN_TEST(test_gone_until_opened_again);
    RUN_TEST(test_lamp_warnings);
    RUN_TEST(test_cancel_while_charging);
    RUN_TEST(test_identity);
    RUN_TEST(test_bad_options_are_the_users_to_mend);
    RUN_TEST(test_no_descriptor_left);
    return UNITY_END();
}
