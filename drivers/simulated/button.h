/* button.h - a button that a schedule, a touched file or a FIFO presses. */
#ifndef SKINSPEC_DRIVERS_SIMULATED_BUTTON_H
#define SKINSPEC_DRIVERS_SIMULATED_BUTTON_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/stat.h>

struct button {
    const char *file; /* "": none; the caller's, as long as the button */
    int fifo;         /* descriptor where the file is a FIFO, else -1 */
    struct stat seen; /* the file when last looked at, all zero while there is none */
    int64_t every_ms; /* 0: no schedule */
    int64_t next_ms;
};

/* false where the FIFO cannot be opened (errno tells). */
bool button_init(struct button *button, const char *file, int64_t every_ms, int64_t now_ms);
void button_done(struct button *button);

/* Whether it was pressed since the last look; several presses are one. */
bool button_pressed(struct button *button, int64_t now_ms);

/* When to look again if nothing becomes readable on button->fifo before. */
int64_t button_look_again_ms(const struct button *button, int64_t now_ms);

#endif
