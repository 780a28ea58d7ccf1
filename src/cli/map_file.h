/* map_file.h - a map as an ENVI cube (float32, BSQ) that grows line by line and outlives a stop.
 *
 *   PREFIX.img, .hdr      the map, once it is whole; the header tells the key as remarks
 *   PREFIX.img.part       the map while it is made, at its full size from the beginning
 *   PREFIX.img.resume     what it is made of (the key), how many lines are in it, and whether it
 *                         replaces a map
 * The key is text, lines "name: value\n", of all that decides a pixel; a run goes on only where it
 * is the same. */
#ifndef SKINSPEC_CLI_MAP_FILE_H
#define SKINSPEC_CLI_MAP_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

enum { MAP_FILE_PATH_SIZE = 4096 };

/* Before each line of the key, in the header. */
#define MAP_FILE_KEY_LINE "; "

struct map_file {
    size_t samples, lines, bands;
    bool replace; /* a map that is there, at the end; else it is refused */
    bool go_on; /* with one that was stopped, where there is one; else it is refused or replaced */
    const char *key;
    char prefix[MAP_FILE_PATH_SIZE];
    char image[MAP_FILE_PATH_SIZE], header[MAP_FILE_PATH_SIZE];
    char part[MAP_FILE_PATH_SIZE], resume[MAP_FILE_PATH_SIZE];
    int fd;
    size_t done; /* lines in it when it was opened */
};

/* Shape, key and the two wishes of *file are the caller's.  STATUS_EXISTS: there is a map, or one
 * begun, or another key; STATUS_FULL and STATUS_IO.  All are logged.  Nothing is left behind then
 * that was not there before.  With one to go on with that is whole already, of the same key, done
 * is all of its lines, and it stays as it is: there is nothing to write or to finish. */
enum status map_file_open(const char *prefix, struct map_file *file);

/* n values of a line, and back.  A line may go over into the next.  STATUS_IO, STATUS_FULL, logged.
 */
enum status map_file_write(const struct map_file *file, size_t band, size_t line, size_t sample,
                           size_t n, const float *value);
enum status map_file_read(const struct map_file *file, size_t band, size_t line, size_t lines,
                          float *value);

/* Lines before this one are in it, and on the disk. */
enum status map_file_note(const struct map_file *file, size_t done);

/* It is whole: under its name, with this text as its header. */
enum status map_file_finish(struct map_file *file, const char *header);

void map_file_close(struct map_file *file);

#endif
