#include "tests/sim/ocean_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Light of the wall that no sample sees; a sphere is never quite closed to it. */
static const double wall_share = 0.006;
static const double wall_reflectance = 0.97;

/* Counts in a microsecond of a perfect white at the lamp's best, so that 20 ms are half of
 * the scale. */
static const double brightest = 1.9;

static double bell(double nm, double centre, double width)
{
    double u = (nm - centre) / width;
    return exp(-u * u / 2);
}

bool ocean_scene_place(struct ocean_scene *scene, const char *what)
{
    static const char *const names[] = { "white", "black", "skin" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(what, names[i]) == 0) {
            scene->under = (enum ocean_under)i;
            return true;
        }
    if (strncmp(what, "grey ", 5) != 0)
        return false;
    char *end;
    double percent = strtod(what + 5, &end);
    if (end == what + 5 || *end != '\0' || !(percent >= 0 && percent <= 100))
        return false;
    scene->under = OCEAN_GREY;
    scene->grey = percent / 100;
    return true;
}

/* Skin as anybody has seen it plotted: rising to the red, haemoglobin's bands at 415, 542 and 577
 * nm, darker skin with weaker bands and a steeper rise. */
static double skin(double lightness, double nm)
{
    double Y = pow((lightness + 16) / 116, 3), depth = 1.4 * Y;
    double bands = bell(nm, 415, 18) + 0.45 * bell(nm, 542, 10) + 0.45 * bell(nm, 577, 9);
    double rise = 1 / (1 + exp(-(nm - 600) / 10));
    double slope = pow(nm / 555, 1.6);
    double R = Y * slope * (1 + 0.5 * rise) * exp(-depth * bands);
    return fmin(R, 0.95);
}

double ocean_scene_reflectance(const struct ocean_scene *scene, double nm)
{
    switch (scene->under) {
    case OCEAN_WHITE: /* a tile, not perfect and not even: nobody may take it for 1 */
        return 0.975 - 0.05 * bell(nm, 360, 40);
    case OCEAN_BLACK: /* a trap */
        return 0;
    case OCEAN_SKIN:
        return skin(scene->lightness, nm);
    case OCEAN_GREY:
        return scene->grey;
    }
    abort();
}

/* Tungsten behind a blue filter, as of 3400 K; a silicon detector and its grating. */
static double lamp_and_detector(double nm)
{
    double at_600 = exp(1.4388e7 / (600.0 * 3400)) - 1;
    double photons = pow(600 / nm, 4) * at_600 / (exp(1.4388e7 / (nm * 3400)) - 1);
    return photons / 1.45 * bell(nm, 560, 180);
}

/* Light of a wavelength in a sphere goes as 1 / (1 - mean reflectance of all its surface at
 * that wavelength); relative to a port as white as the wall. */
static double sphere(const struct ocean_scene *scene, double nm)
{
    if (scene->substitution == 0)
        return 1;
    double f = scene->substitution;
    double all = (1 - f) * wall_reflectance + f * ocean_scene_reflectance(scene, nm);
    return (1 - wall_reflectance) / (1 - all);
}

double ocean_scene_light(const struct ocean_scene *scene, double nm)
{
    return brightest * scene->lamp * lamp_and_detector(nm) * sphere(scene, nm) *
           (ocean_scene_reflectance(scene, nm) + wall_share);
}
