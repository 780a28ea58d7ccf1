/* button.c - whoever presses, it is one press at a time. */
#include "drivers/simulated/button.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

/* A touched file wakes nobody: it is looked at this often. */
enum { LOOK_EVERY_MS = 20 };

static void look_at(const char *file, struct stat *ret)
{
    if (stat(file, ret) != 0)
        memset(ret, 0, sizeof *ret);
}

bool button_init(struct button *button, const char *file, int64_t every_ms, int64_t now_ms)
{
    *button = (struct button){ .file = file, .fifo = -1, .every_ms = every_ms };
    button->next_ms = now_ms + every_ms;
    if (file[0] == '\0')
        return true;
    look_at(file, &button->seen);
    if (!S_ISFIFO(button->seen.st_mode))
        return true;
    /* For writing too: with no writer left a FIFO would be readable for ever. */
    button->fifo = open(file, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return button->fifo >= 0;
}

void button_done(struct button *button)
{
    if (button->fifo >= 0)
        close(button->fifo);
}

static bool written_to(int fifo)
{
    char bytes[4096];
    bool any = false;
    /* A pipe holds 64 kB: no more, lest a flood of presses keeps us here. */
    for (int i = 0; i < 16 && read(fifo, bytes, sizeof bytes) > 0; i++)
        any = true;
    return any;
}

static bool touched(struct button *button)
{
    struct stat before = button->seen, *now = &button->seen;
    look_at(button->file, now);
    return now->st_nlink > 0 && (now->st_ino != before.st_ino || now->st_size != before.st_size ||
                                 now->st_mtim.tv_sec != before.st_mtim.tv_sec ||
                                 now->st_mtim.tv_nsec != before.st_mtim.tv_nsec);
}

bool button_pressed(struct button *button, int64_t now_ms)
{
    bool pressed = false;
    if (button->every_ms > 0 && now_ms >= button->next_ms) {
        button->next_ms += ((now_ms - button->next_ms) / button->every_ms + 1) * button->every_ms;
        pressed = true;
    }
    if (button->fifo >= 0)
        pressed = written_to(button->fifo) || pressed;
    else if (button->file[0] != '\0')
        pressed = touched(button) || pressed;
    return pressed;
}

int64_t button_look_again_ms(const struct button *button, int64_t now_ms)
{
    int64_t next = INT64_MAX;
    if (button->every_ms > 0)
        next = button->next_ms;
    if (button->fifo < 0 && button->file[0] != '\0' && now_ms + LOOK_EVERY_MS < next)
        next = now_ms + LOOK_EVERY_MS;
    return next;
}
