/* ocean_scene.h - lamp, sphere and what lies under its port: light on each pixel. */
#ifndef SKINSPEC_TESTS_SIM_OCEAN_SCENE_H
#define SKINSPEC_TESTS_SIM_OCEAN_SCENE_H

#include <stdbool.h>

enum ocean_under { OCEAN_WHITE, OCEAN_BLACK, OCEAN_SKIN, OCEAN_GREY };

struct ocean_scene {
    enum ocean_under under;
    double grey;         /* reflectance of the grey, 0 .. 1 */
    double lightness;    /* of the skin, L* roughly, 5 .. 95 */
    double lamp;         /* factor on its light */
    double substitution; /* share of the sphere that the port is */
};

/* "white", "black", "skin", "grey 18". */
bool ocean_scene_place(struct ocean_scene *scene, const char *what);

/* Reflectance of what lies there, without its gloss. */
double ocean_scene_reflectance(const struct ocean_scene *scene, double nm);

/* Light at nm that reaches the detector, counts of 65536 in a microsecond: lamp and
 * grating x sphere x reflectance; with the little that the sphere itself sends there. */
double ocean_scene_light(const struct ocean_scene *scene, double nm);

#endif
