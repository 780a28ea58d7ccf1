/* doctor_point.c - the open points of each driver. */
#include "cli/doctor_point.h"

#include <string.h>

static const struct doctor_point points[] = {
    { "", "label", NULL, false,
      "What does the label of the instrument say: model, and numbers that are no serial number?" },
    { "", "display", NULL, false,
      "If it shows L*, a*, b* of the last shot itself: which, under which light and observer?" },
    { "km_ascii", "slider small", "Move the aperture slider to the small port (SAV, 3 mm)", true,
      "What does the label call this port? (a refusal above is as it should be: the capture now "
      "has the port's number)" },
    { "km_ascii", "slider large", "Move the slider back to the large port (MAV, 8 mm)", true,
      "Did the display change with the slider?" },
    { "km_ascii", "button", NULL, false,
      "When you pressed the button: did the instrument flash at once, and show a result?" },
    { "km_ascii", "decimals", NULL, false,
      "CM-2600d, CM-2500d: how many decimals has a reflectance on its display?" },
    { "km_ascii", "model id", NULL, false,
      "CM-600d, CM-2500d: is the model that was told at the beginning the one on the label?" },
    { "xrite_rci", "firmware", NULL, false, "Which firmware does its own menu name?" },
    { "xrite_rci", "calibration", NULL, false,
      "During the calibrations: what did its display ask for, in which order, and which key did "
      "you press?" },
    { "xrite_rci", "measure", NULL, false,
      "When the station measured: did it flash at once, or wait for you to press the shoe down?" },
    { "xrite_rci", "apertures", NULL, false,
      "Which aperture is built in or set, and is it the one told at the beginning?" },
    { "ocean_ooi", "label", NULL, false,
      "Is it a USB2000+ or a Flame-S (USB4000 or Flame-T)? The capture has what it says itself." },
    { "ocean_ooi", "lamp off", "Switch the lamp off, leave all else as it is", true,
      "Did this shot come out dark, or was it still bright? (a spectrum from before was sent)" },
    { "ocean_ooi", "lamp on", "Switch the lamp on and let it warm up", true,
      "Which lamp, which sphere, and is its gloss trap open?" },
    { "ocean_ooi", "speed", NULL, false, "Is it at a USB 2 port by itself, or behind a hub?" },
};

const struct doctor_point *doctor_point(const char *driver, size_t i)
{
    for (size_t at = 0; at < sizeof points / sizeof *points; at++)
        if ((points[at].driver[0] == '\0' || strcmp(points[at].driver, driver) == 0) && i-- == 0)
            return &points[at];
    return NULL;
}
